/// \file
/// The demo's films and pictures, made by `afterglow render` out of what was recorded.
#pragma once

#include <future>
#include <string>
#include <vector>

#include "nodes/kitting/demo_report.hpp"
#include "nodes/kitting/demo_story.hpp"
#include "nodes/tools/work_folder.hpp"

namespace afterglow::nodes {

/// Folder of the scenario's YAML files, folder to fill.
struct DemoFolders {
  std::string assets, out;
};

/// Runs programs with so low a priority that they take only what no replay needs.
class DemoFilms {
 public:
  explicit DemoFilms(const DemoFolders& folders);

  /// Begins to make key frames and films of a behavior that was replayed, and returns at once.
  void begin(const MeasuredBehavior& measured, const BehaviorStory& story);
  /// Waits for all of them, and puts those of full length together. Throws std::runtime_error.
  void finish(const std::string& video);

 private:
  using Command = std::vector<std::string>;

  void run(std::vector<Command> commands);
  Command keyFrames(const MeasuredBehavior& measured, bool is_replay, bool is_observed) const;

  const DemoFolders folders_;
  const WorkFolder work_;
  std::vector<std::string> parts_;  ///< parts of the long film
  std::vector<std::future<void>> running_;
};

}  // namespace afterglow::nodes
