/// \file
/// Two behaviors' stories side by side: what both have, and what one lacks.
#pragma once

#include <optional>
#include <vector>

#include "nodes/console/behavior_story.hpp"

namespace afterglow::nodes {

/// One line of both; empty: that story has nothing like it.
struct StoryPair {
  std::optional<std::size_t> a, b;  ///< indexes into the two stories
};

/// By the longest sequence of subjects that both have (LCS); of each story at most 300 entries.
std::vector<StoryPair> pairStories(const std::vector<StoryEntry>& a,
                                   const std::vector<StoryEntry>& b);

}  // namespace afterglow::nodes
