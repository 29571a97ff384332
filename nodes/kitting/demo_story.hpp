/// \file
/// The demo's words for people: captions of its films, texts of its report.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace afterglow::nodes {

struct BehaviorStory {
  std::string name;  ///< the behavior's: "pick"
  std::string title, caption, question, explanation;
  /// Moments worth an image, by name, in order, and what happens at each.
  std::vector<std::pair<std::string, std::string>> moments;
  std::string says = {};  ///< the robot, aloud
};

struct DemoStory {
  std::string title, subtitle;
  std::vector<BehaviorStory> behaviors;  ///< behaviors in the order they are done
};

/// Throws std::runtime_error "FILE:LINE: what is wrong".
DemoStory loadDemoStory(const std::string& path);

}  // namespace afterglow::nodes
