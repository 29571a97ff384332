/// \file
/// sound_play/SoundRequest in each of its three definitions; roscpp takes only the newest.
#pragma once

#include <sound_play/SoundRequest.h>

#include <optional>

#include "replay/messages/message.hpp"

namespace afterglow::nodes {

/// Reads by the channel's own definition. A missing volume is 1, as it was before volume existed.
/// Empty if the type is no SoundRequest, or the bytes do not fit.
std::optional<sound_play::SoundRequest> soundRequestOf(const replay::Channel& channel,
                                                       const replay::Bytes& bytes);

}  // namespace afterglow::nodes
