/// \file
/// sound_play/SoundRequest in each of its three definitions; roscpp takes only the newest.
#pragma once

#include <sound_play/SoundRequest.h>

#include <optional>
#include <string>

#include "replay/messages/message.hpp"

namespace afterglow::nodes {

/// Reads by the channel's own definition. A missing volume is 1, as it was before volume existed.
/// Empty if the type is no SoundRequest, or the bytes do not fit.
std::optional<sound_play::SoundRequest> soundRequestOf(const replay::Channel& channel,
                                                       const replay::Bytes& bytes);

/// Returns true if a node is sound_play's own, by the name that it is usually run under.
bool isSoundPlay(const std::string& node);

/// The voice to ask sound_play for: Festival's are named voice_..., as sound_play has them; for
/// others, eSpeak's, it would say nothing at all ("unbound variable").
std::string soundPlayVoice(const std::string& voice);

}  // namespace afterglow::nodes
