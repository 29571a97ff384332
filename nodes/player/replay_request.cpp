#include "nodes/player/replay_request.hpp"

#include <fmt/format.h>
#include <geometry_msgs/Twist.h>
#include <ros/names.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "nodes/player/media_sink.hpp"
#include "nodes/player/robot_file.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/plan/topic_role.hpp"
#include "replay/query/behavior_selector.hpp"
#include "replay/record/snapshot.hpp"

namespace afterglow::nodes {
namespace {

/// Refuses what is only for light and speech.
void refuseForBody(const replay::PlayPlan& plan, const ReplayRequest& request,
                   const std::string& called) {
  const std::vector<std::string> motion = plan.motionTopics();
  if (motion.empty()) return;
  const std::string moves =
      fmt::format("{} moves the robot ({}): ", called, fmt::join(motion, ", "));
  if (request.options.is_looping || request.options.is_immediate) {
    throw std::runtime_error(moves + "loops and haste are for light and speech only (ar,speech)");
  }
  if (!request.rate_control.topic.empty()) {
    throw std::runtime_error(moves + "only light and speech (ar,speech) wait for " +
                             request.rate_control.topic);
  }
}

std::string calledText(const replay::Behavior& behavior) {
  return "behavior " + std::to_string(behavior.id) + " '" + behavior.name + "'";
}

/// Returns ROS's name for a name, by the remappings that this process was started with. It makes it
/// of published names again, so that they have to stay.
replay::TopicName rosName(const replay::TopicName& name) {
  const std::string renamed = ros::names::resolve(name.text());
  if (const std::string again = ros::names::resolve(renamed); again != renamed) {
    throw std::runtime_error("ROS renames " + name.text() + " to " + renamed + " and that to " +
                             again + ": one of the two");
  }
  return renamed;
}

/// Returns what the replay listens to for its safety, by the names that ROS has for it.
std::map<replay::TopicName, std::string> obeyedBy(const ReplayRequest& request) {
  std::map<replay::TopicName, std::string> obeyed;
  const auto add = [&obeyed](const std::string& topic, const char* noun) {
    if (!topic.empty()) obeyed.emplace(rosName(topic), noun);
  };
  const StopOptions& stops = request.body.stops;
  add(stops.emergency_stop.topic, "the emergency stop");
  add(stops.hold_button.topic, "the button to be held");
  add(request.rate_control.topic, "the consumer");
  if (request.clock == ReplayClock::Follow) add("/clock", "the clock");
  const ScanOptions& scan = request.body.base.scan;
  if (request.allow_motion && !scan.is_waived) add(scan.topic, "the scan");
  return obeyed;
}

replay::PlanOptions planOptions(const ReplayRequest& request) {
  replay::PlanOptions options = request.plan;
  options.only = replay::parseModalities(request.only);
  options.robot = request.body.robot;
  options.resolve = rosName;
  options.obeyed = obeyedBy(request);
  options.is_motion_allowed = request.allow_motion;
  options.place = request.place();
  if (!request.body.base.topic.empty()) options.settled.push_back(request.body.base.topic);
  return options;
}

/// Adds a way of the base where an arm alone was recorded: --to-start takes it there by the
/// profile's velocities.
void addWayOfBase(const ReplayRequest& request, replay::PlayPlan& plan) {
  using geometry_msgs::Twist;
  namespace traits = ros::message_traits;
  const std::string& topic = request.body.robot.base.velocity_topic;
  const bool is_there = std::any_of(plan.topics.begin(), plan.topics.end(), [&](const auto& known) {
    return known.channel.topic == topic || known.output.topic == topic ||
           (known.isPlayed() && stopOf(known).isSetPoint());
  });
  const bool goes_there = request.body.start == BodyOptions::Start::MoveThere;
  if (!goes_there || topic.empty() || is_there || plan.motionTopics().empty()) return;
  replay::PlannedTopic way;
  way.recorded = replay::TopicName(topic);
  way.channel = way.output = {topic, traits::DataType<Twist>::value(),
                              traits::MD5Sum<Twist>::value(), traits::Definition<Twist>::value(),
                              false, ""};
  way.output.topic = rosName(*way.recorded).text();
  way.named_by = replay::NamedBy::Owner;
  way.verdict = replay::verdictOf({replay::TopicKind::Body, way.named_by, request.allow_motion,
                                   request.place()});
  way.modality = replay::Modality::Body;
  way.topic_class = replay::TopicClass::Body;
  way.why_class = "--to-start drives the base there";
  way.is_for_start = true;
  plan.topics.push_back(std::move(way));
}

/// Returns the renaming from the recorded robot to today's. What was recorded without these names
/// is as it was.
replay::RobotRenaming renamingOf(const replay::Behavior& behavior, const std::string& asked) {
  const auto recorded = replay::recordedRobot(behavior);
  std::string now = asked.empty() ? rosNamespace() : replay::cleanNamespace(asked);
  if (!recorded) return {{now, ""}, {now, ""}};
  if (asked.empty() && now.empty()) now = recorded->name_space;
  const bool is_same = now == recorded->name_space;
  return renamingTo(*recorded, now, is_same ? "" : robotParameter(now, "tf_prefix"));
}

}  // namespace

ReplayRequest forItsRobot(const replay::Store& store, ReplayRequest request) {
  const replay::RobotRenaming robot =
      renamingOf(replay::selectBehavior(store, request.behavior), request.robot_namespace);
  BodyOptions& body = request.body;
  // Topics are today's, and frames are renamed with all that was recorded.
  body.robot = withNames(body.robot, {robot.live.name_space, robot.recorded.frame_prefix});
  body.base.usual_topic = body.robot.base.velocity_topic;
  if (!body.stops.emergency_stop.profile.empty()) {
    body.stops.emergency_stop.topic = body.robot.emergency_stop.topic;
  }
  if (body.base.scan.topic.empty()) body.base.scan.topic = body.robot.scan_topic;
  for (std::string* frame :
       {&body.base.frames.map, &body.base.frames.odometry, &body.base.frames.base}) {
    *frame = robot.recorded.frame(*frame);
  }
  body.base.robot = robot.live;
  request.plan.rewriting.robot = robot;
  return request;
}

replay::ReplayPlace ReplayRequest::place() const {
  const bool is_away = !plan.prefix.empty() && !allow_motion && !is_prefix_live;
  return everything || is_away ? replay::ReplayPlace::Elsewhere : replay::ReplayPlace::Robot;
}

std::string reasonOf(const replay::PlannedTopic& topic) {
  const bool is_all = topic.isPlayed() || topic.why_not == topic.why_class;
  return is_all ? topic.why_class : topic.why_not + " (" + topic.why_class + ")";
}

void checkSomethingToPlay(const replay::PlayPlan& plan, const ReplayRequest& request) {
  if (!plan.playedTopics().empty()) return;
  const std::string left_out = plan.leftOutText();
  throw std::runtime_error(calledText(plan.behavior) + ": there is nothing to play" +
                           (request.only.empty() ? "" : " of " + request.only) +
                           (left_out.empty() ? "" : "; " + left_out));
}

replay::PlayPlan planReplay(const replay::Store& store, const ReplayRequest& request) {
  const replay::Behavior behavior = replay::selectBehavior(store, request.behavior);
  const std::string called = calledText(behavior);
  replay::PlayPlan plan = makePlan(store, behavior, planOptions(request));
  if (plan.playedTopics().empty()) {
    return plan;
  }
  const std::string first = plan.playedTopics().front();
  MediaPreparation::fit(store, plan, request.anchors);
  for (const replay::PlannedTopic& topic : plan.topics) {
    if (plan.playedTopics().empty() && topic.channel.topic == first) {
      throw std::runtime_error(called + ", " + first + ": " + topic.why_not);
    }
  }
  refuseForBody(plan, request, called);
  addWayOfBase(request, plan);
  return plan;
}

replay::PlayPlan countRewrites(const replay::Store& store, replay::PlayPlan plan,
                               ReplayClock clock) {
  replay::Rewriter rewriter(replay::uniqueGoalIds("dry_run"), plan.rewriting);
  const auto cursor = store.messages(plan.behavior, {plan.playedTopics(), plan.begin, plan.end});
  // Any other time: what is to be shifted is shifted.
  const std::int64_t shift = clock == ReplayClock::Sim ? 0 : 1'000'000'000;
  while (auto message = cursor->next()) {
    const replay::Stamp now{message->received.ns + shift};
    try {
      (void)rewriter.rewrite(store.channel(message->channel), {now, shift}, message->bytes);
    } catch (const replay::MessageError&) {  // refused when it is played, too
    }
  }
  for (replay::PlannedTopic& topic : plan.topics) {
    if (topic.isPlayed()) topic.rewrites = rewriter.rules(topic.channel);
  }
  return plan;
}

}  // namespace afterglow::nodes
