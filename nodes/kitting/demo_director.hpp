/// \file
/// The demo from beginning to end: the task is done and recorded, the objects are taken away, every
/// behavior is found by name and replayed; a bystander's view films it all.
#pragma once

#include <string>
#include <vector>

#include "nodes/kitting/bystander.hpp"
#include "nodes/kitting/demo_clients.hpp"
#include "nodes/kitting/demo_progress.hpp"
#include "nodes/kitting/demo_report.hpp"
#include "nodes/kitting/demo_story.hpp"
#include "nodes/kitting/kitting_task.hpp"

namespace afterglow::nodes {

/// Files and folders of one run.
struct DemoFiles {
  std::string assets;  ///< folder of the scenario's YAML files
  std::string out;     ///< folder to fill
  std::string store;   ///< file in it that the recorder was told to use
  std::string typed_out, typed_assets, typed_command;  ///< and the afterglow command, as typed
};

/// Runs in the caller's thread; needs a running spinner. Throws TaskError or std::runtime_error,
/// one line, when a step fails.
class DemoDirector {
 public:
  DemoDirector(const DemoFiles& files, DemoProgress& progress);

  /// Returns what was measured, the report's files not yet written.
  DemoReport run();
  const DemoStory& story() const { return story_; }

 private:
  void waitUntilReady();
  void record(const BehaviorStory& behavior);
  void removeObjects();
  void replay(MeasuredBehavior& measured, const BehaviorStory& behavior);
  void onMoment(const std::string& moment);
  void readStore();
  void finishFilm();
  std::string sayingOf(const std::string& behavior) const;
  static std::string pictureName(const std::string& behavior, const std::string& moment,
                                 const char* run);
  EndPose endPose() const;
  void doBehavior(const std::string& name);

  DemoFiles files_;
  DemoProgress& progress_;
  DemoStory story_;
  KittingPlan plan_;
  KittingRobot robot_;
  KittingRoom room_;
  KittingTask task_;
  DemoRecorder recorder_;
  PlayerClient player_;
  Bystander bystander_;
  DemoReport report_;
  ros::WallTime begin_;
  MeasuredBehavior* recording_ = nullptr;  ///< while a behavior is done
  ros::WallTime recording_began_;
};

}  // namespace afterglow::nodes
