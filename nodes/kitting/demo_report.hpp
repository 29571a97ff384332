/// \file
/// The demo's measurements, as summary.json and as a page for people. Pure: values in, text out.
///
/// The demo's words for people: captions of its films, texts of its report.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "replay/motion/planar_pose.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

struct BehaviorStory {
  std::string name;  ///< the behavior's: "pick"
  std::string title, caption, question, explanation;
  std::string light;  ///< what was lit, in a line
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

/// The same moment of a behavior when it was done and when it was replayed.
struct KeyFrame {
  std::string moment;
  double offset_s = 0;       ///< time into the behavior
  std::string live, replay;  ///< images, frames/NAME.png and frames/NAME_projector.png
  double replay_offset_s = 0;  ///< time into the recording of its replay
};

/// The robot's place at a behavior's end.
struct EndPose {
  replay::PlanarPose base;                                      ///< map
  Eigen::Vector3d p_gripper = Eigen::Vector3d::Zero();  ///< map
};

/// A behavior, done and replayed.
struct MeasuredBehavior {
  replay::Behavior behavior;
  std::vector<replay::TopicSummary> topics;  ///< its own ones; count 0: nothing was said there
  std::uint64_t messages = 0, dropped = 0;   ///< the recorder's counts
  std::string says;
  std::vector<KeyFrame> key_frames;
  EndPose live_end, replay_end;
  double replay_s = 0;
  nlohmann::json player_report;  ///< the player's
  std::int64_t replay_id = 0;    ///< the replay, recorded
  std::string film;  ///< the short one, relative to the report; empty: none
};

struct DemoReport {
  std::string date;                                           ///< local, to the minute
  std::vector<std::pair<std::string, std::string>> versions;  ///< versions by name
  std::vector<MeasuredBehavior> behaviors;
  std::string video, store;  ///< relative to the report
  std::string folder;        ///< the report's folder, as people type it
  std::string assets;        ///< the demo's own folder, as people type it
  std::string command;       ///< the afterglow command, as people type it
  double wall_s = 0;         ///< the whole demo
};

/// The distance of two ends: centimeters on the floor, degrees of heading, centimeters between
/// the grippers.
struct EndError {
  double base_cm = 0, heading_deg = 0, gripper_cm = 0;
};
EndError endError(const EndPose& recorded, const EndPose& replayed);

/// The lateness of messages, milliseconds: each the worst topic's, from the player's report.
struct ReplayLateness {
  double median_ms = 0, p99_ms = 0, max_ms = 0;
};
/// Throws std::runtime_error if the report lacks it.
ReplayLateness latenessOf(const nlohmann::json& player_report);

double durationOf(const replay::Behavior& behavior);  ///< seconds; 0 while it runs

/// The words after `afterglow` that film the replay of a behavior, the behavior beside it.
std::vector<std::string> filmArguments(const MeasuredBehavior& measured, const std::string& assets);

/// Commands for people to try on what was recorded, from the folder they built in.
std::vector<std::string> commandsToTry(const DemoReport& report);

nlohmann::json summaryJson(const DemoReport& report);

/// A page that needs no network and no script; video and images lie beside it.
std::string reportHtml(const DemoReport& report, const DemoStory& story);

}  // namespace afterglow::nodes
