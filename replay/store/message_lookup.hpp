/// \file
/// Single messages of a behavior, found without reading all of it.
#pragma once

#include <optional>
#include <string>

#include "replay/store/store.hpp"

namespace afterglow::replay {

/// Returns the newest message on the topic, a behavior's own or one of its context, at or before
/// the moment; found by looking back twice as far each time. Throws StoreError.
std::optional<Message> newestMessage(const Store& store, const Behavior& behavior,
                                     const std::string& topic, Stamp moment);

}  // namespace afterglow::replay
