/// \file
/// The demo from beginning to end: the task is done and recorded, the objects are taken away, the
/// robot is asked about every behavior and answers by a replay, which is recorded, too; both are
/// filmed.
///
/// The demo's films and pictures, made by `afterglow render` out of what was recorded.
#pragma once

#include <tf2_ros/static_transform_broadcaster.h>

#include <future>
#include <map>
#include <string>
#include <vector>

#include "nodes/kitting/demo_clients.hpp"
#include "nodes/kitting/demo_report.hpp"
#include "nodes/kitting/kitting_task.hpp"
#include "nodes/tools/video_writer.hpp"

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

/// Runs in the caller's thread and tells standard output of each stage; needs a running spinner.
/// Throws TaskError or std::runtime_error, one line, when a stage fails.
class DemoDirector {
 public:
  explicit DemoDirector(const DemoFolders& folders);

  /// Returns what was measured, the report's files not yet written.
  DemoReport run();
  const DemoStory& story() const { return story_; }

 private:
  /// The room from a moment of a behavior on, seconds.
  struct RoomThen {
    double offset_s;
    KittingRoom room;
  };
  /// The number of a behavior's key frames and rooms that its replay has shown.
  struct Shown {
    std::size_t frames = 0, rooms = 0;
  };

  void showRoom();
  void keepRoom();
  void waitUntilReady();
  void record(const BehaviorStory& behavior);
  void removeObjects();
  void replay(MeasuredBehavior& measured, const BehaviorStory& behavior);
  void onReplayed(double position, MeasuredBehavior& measured, Shown& shown);
  void finishFilms();
  void onMoment(const std::string& moment);
  void say();
  void readStore(MeasuredBehavior& measured) const;
  EndPose endPose() const;

  DemoFolders folders_;
  DemoStory story_;
  KittingRobot robot_;
  KittingRoom room_;
  std::map<std::string, std::vector<RoomThen>> rooms_then_;  ///< rooms by behavior, in order
  KittingTask task_;
  AskClient robot_asked_;
  DemoFilms films_;
  ros::Publisher solids_, obstacles_;
  tf2_ros::StaticTransformBroadcaster static_tf_;
  DemoReport report_;
  const BehaviorStory* recorded_ = nullptr;  ///< the behavior that is being done
  ros::WallTime recording_began_;            ///< the behavior's or its replay's
};

}  // namespace afterglow::nodes
