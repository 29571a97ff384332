/// \file
/// sound_play/SoundRequest of any age: it has had three definitions, of which roscpp takes one.
#pragma once

#include <sound_play/SoundRequest.h>

#include <optional>

#include "replay/messages/message.hpp"

namespace afterglow::nodes {

/// By the channel's own definition. Before arg2 and volume were added, everything was loud: a
/// volume that is missing is 1. Empty if it is no SoundRequest, or the bytes do not fit.
std::optional<sound_play::SoundRequest> soundRequestOf(const replay::Channel& channel,
                                                       const replay::Bytes& bytes);

}  // namespace afterglow::nodes
