/// \file
/// Words of a filter that no stored behavior has: mostly typing errors.
#pragma once

#include <string>

#include "replay/store/store.hpp"

namespace afterglow::replay {

/// Returns which name, outcome, topic, robot and tag of the filter no behavior of the store has,
/// with the nearest that one has: `none has the tag "kep"; did you mean keep?`. Empty if each
/// occurs. Reads all behaviors, no messages.
std::string unknownWords(const Store& store, const BehaviorFilter& filter);

}  // namespace afterglow::replay
