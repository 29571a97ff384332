/// \file
/// SoundRequest's built-in sounds, made here: sound_play's own files come with sound_play.
#pragma once

#include <memory>

#include "nodes/speaker/sound.hpp"

namespace afterglow::nodes {

/// BACKINGUP (1) to NEEDS_PLUGGING_BADLY (5): beeps, told apart by pitch and number, and followed
/// by a rest, to be looped. Null for other numbers.
std::shared_ptr<const Sound> builtInSound(int number);

}  // namespace afterglow::nodes
