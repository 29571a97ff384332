/// \file
/// What the robot said in a behavior.
#pragma once

#include <string>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::replay {

/// The sentences of its sound_play/SoundRequests, in order, of any definition; the first 20. Throws
/// StoreError. A message that cannot be read is left out.
std::vector<std::string> saidIn(const Store& store, const Behavior& behavior);

}  // namespace afterglow::replay
