/// \file
/// What a topic said last at a moment of a behavior.
#pragma once

#include <optional>
#include <string>

#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// The newest message on the topic, a behavior's own or one of its context, at or before the
/// moment; found by looking back twice as far each time. Nothing: there is none in the behavior.
/// Throws replay::StoreError.
std::optional<replay::Message> newestMessage(const replay::Store& store,
                                             const replay::Behavior& behavior,
                                             const std::string& topic, replay::Stamp moment);

}  // namespace afterglow::nodes
