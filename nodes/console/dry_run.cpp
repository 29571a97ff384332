#include "nodes/console/dry_run.hpp"

#include <fmt/format.h>
#include <ros/ros.h>

#include <cmath>
#include <map>
#include <stdexcept>
#include <vector>

#include "nodes/player/live_graph.hpp"
#include "nodes/player/play_options.hpp"
#include "nodes/player/player_node.hpp"
#include "nodes/player/replay_session.hpp"
#include "nodes/player/robot_description.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

/// The fastest of each unit: "up to 0.2 m/s (linear velocity), 0.45 rad/s (...)".
std::string speedText(const std::vector<replay::MotionPeak>& peaks, double rate) {
  std::map<std::string, std::pair<double, std::string>> fastest;
  for (const replay::MotionPeak& peak : peaks) {
    if (peak.power != 1) continue;
    auto& [value, what] = fastest[peak.unit];
    if (!what.empty() && std::abs(peak.value) <= value) continue;
    value = std::abs(peak.value);
    what = peak.what;
  }
  std::vector<std::string> parts;
  for (const auto& [unit, peak] : fastest) {
    parts.push_back(
        fmt::format("{:.2f} {} ({})", peak.first * rate, unit, peak.second));
  }
  if (parts.empty()) return fmt::format("{} times as fast as it was", rate);
  return fmt::format("up to {}", fmt::join(parts, ", "));
}

std::string robotName(const replay::Store& store, const replay::PlayPlan& plan,
                      const ReplayRequest& request) {
  if (!request.body.robot.name.empty()) return request.body.robot.name;
  const std::string name = recordedJoints(store, plan.behavior, request.body.robot).robotName();
  return name.empty() ? "the robot" : name;
}

std::string whyOf(const replay::PlannedTopic& topic) {
  const bool is_all = topic.isPlayed() || topic.why_not == topic.why_class;
  return is_all ? topic.why_class : topic.why_not + " (" + topic.why_class + ")";
}

ReplayRequest requestOf(const std::string& player, const std::string& store,
                        const PlayWish& wish) {
  const PlayerNodeOptions options = PlayerNodeOptions::read(ros::NodeHandle(player));
  if (replay::storeUri(options.store) != replay::storeUri(store)) {
    throw std::runtime_error("the player plays from another store, " +
                             replay::storeUri(options.store) + ": its behaviors are others");
  }
  ReplayRequest request = options.replays;
  request.behavior = std::to_string(wish.behavior);
  giveGoalOptions(request, wish.options());
  if (request.robot_namespace.empty()) {  // the player's, not that of this process
    request.robot_namespace = replay::cleanNamespace(ros::names::parentNamespace(player));
  }
  lookAround(request, deadlineIn(kMasterPatience));
  return request;
}

}  // namespace

DryRun rehearseAs(const std::string& player, const std::string& store_uri,
                  const replay::Store& store, const PlayWish& wish,
                  const std::function<bool()>& is_stopped) {
  DryRun dry;
  try {
    const ReplayRequest request = requestOf(player, store_uri, wish);
    ReplaySession session(store, request);
    const replay::PlayPlan& plan = session.plan();
    for (const replay::PlannedTopic& topic : plan.topics) {
      dry.topics.push_back({{"topic", topic.output.topic.empty() ? topic.channel.topic
                                                                 : topic.output.topic},
                            {"type", topic.channel.type},
                            {"published", topic.isPlayed()},
                            {"reason", whyOf(topic)}});
    }
    dry.moves = !plan.motionTopics().empty();
    if (dry.moves) {
      dry.robot = robotName(store, plan, request);
      dry.speed = speedText(session.peaks(), request.options.rate);
    }
    const Rehearsal rehearsal = session.rehearse(true, is_stopped);
    dry.refusal = fmt::format("{}", fmt::join(rehearsal.refusals, "; "));
    dry.unchecked = fmt::format("{}", fmt::join(rehearsal.unchecked, "; "));
  } catch (const std::exception& error) {
    dry.refusal = error.what();
  }
  return dry;
}

}  // namespace afterglow::nodes
