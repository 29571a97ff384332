/// \file
/// Selects a behavior by id, by name or in words: "3", "pick", "the last failed pick".
#pragma once

#include <string>

#include "replay/store/store.hpp"

namespace afterglow::replay {

/// The one behavior that `text` selects:
///   3                     the one of this id; also a key of 32 hex digits
///   pick                  the newest of this name; else of this name with other capitals; else of
///                         the one name that contains it
///   last|first pick       the newest, the oldest; latest, newest and oldest are understood as well
///   second last pick      the one before the newest; third ... tenth, 2nd ... 10th
///   second pick           counted from the oldest
///   failed pick           the newest of this outcome: failed is failure, succeeded success; any
///                         outcome in the store may be named as it is
///   the last failure      of any name; "the", "one" and "behavior" mean nothing
/// A text that is a name is taken as the name, not as words. Throws StoreError, one line with the
/// nearest names, if there is no such behavior, and if several names fit.
Behavior selectBehavior(const Store& store, const std::string& text);

}  // namespace afterglow::replay
