/// \file
/// A behavior as people say which: "3", "pick", "the last failed pick", "second last pick".
#pragma once

#include <string>

#include "replay/store/store.hpp"

namespace afterglow::replay {

/// The one behavior that `text` selects:
///   3                     that of this id; also a key of 32 hex digits
///   pick                  the newest of this name, of this name whatever its capitals, or of the
///                         one name that contains it
///   last|first pick       the newest, the oldest; latest, newest and oldest are understood as well
///   second last pick      the one before the newest; third ... tenth, 2nd ... 10th
///   second pick           counted from the oldest
///   failed pick           the newest of this outcome: failed is failure, succeeded success; any
///                         outcome in the store is understood as it is
///   the last failure      of any name; "the", "one" and "behavior" say nothing
/// A name goes before words. Throws StoreError, one line with the nearest names, for what is not
/// there and for what several names fit.
Behavior selectBehavior(const Store& store, const std::string& text);

}  // namespace afterglow::replay
