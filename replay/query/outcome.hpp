/// \file
/// The meaning of an outcome's word: the one rule for colors, counts and stories.
#pragma once

#include <string>

namespace afterglow::replay {

/// Other: it ended as it was meant to, or nobody says how: stopped, halted, imported, any word that
/// is not known. Open: it runs, or has no result.
enum class OutcomeLook { Open, Good, Other, Bad };

/// Returns the look of an outcome of behaviors, action goals and behavior trees' nodes; capitals
/// aside.
OutcomeLook lookOf(const std::string& outcome);
/// "open", "good", "other", "bad".
const char* nameOf(OutcomeLook look);

}  // namespace afterglow::replay
