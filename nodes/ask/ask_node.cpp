#include "nodes/ask/ask_node.hpp"

#include <afterglow/AskActionGoal.h>
#include <sound_play/SoundRequest.h>

#include "nodes/ask/question_file.hpp"
#include "replay/ask/said.hpp"
#include "replay/query/time_text.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::size_t kRemembered = 500;      // behaviors, the newest
constexpr double kLettersPerSecond = 12;      // of slow speech
constexpr double kEcho = 1;                   // s until a recognizer has told what it heard last
const ros::Duration kPlayerPatience(2);       // for player_node to be there

std::uint8_t kindOf(const replay::AskAnswer& answer) {
  switch (answer.kind) {
    case replay::AskAnswer::Kind::Found:
      return AskResult::TOLD;
    case replay::AskAnswer::Kind::AskedBack:
      return AskResult::ASKED_BACK;
    default:
      return AskResult::UNKNOWN;
  }
}

}  // namespace

AskNodeOptions AskNodeOptions::read(const ros::NodeHandle& private_node) {
  AskNodeOptions options;
  private_node.param("store", options.store, options.store);
  private_node.param("questions", options.questions, options.questions);
  private_node.param("player", options.player, options.player);
  private_node.param("allow_motion", options.allow_motion, options.allow_motion);
  return options;
}

AskNode::AskNode(const AskNodeOptions& options)
    : options_(options),
      asking_(readQuestions(options.questions)),
      server_(node_, "ask", [this](const AskGoalConstPtr& goal) { onGoal(goal); }, false) {
  goals_ = node_.advertise<AskActionGoal>("ask/goal", 1);
  speech_ = node_.advertise<sound_play::SoundRequest>("robotsound", 5);
  server_.start();
  heard_ = private_node_.subscribe("ask", 5, &AskNode::onHeard, this);
}

/// A recognizer hears the robot, too: while it answers or speaks, nobody else was heard.
void AskNode::onHeard(const std_msgs::String& text) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (is_answering_ || ros::WallTime::now() < quiet_from_) return;
  }
  AskActionGoal goal;
  goal.header.stamp = goal.goal_id.stamp = ros::Time::now();
  goal.goal_id.id = ros::this_node::getName() + "-" + std::to_string(ros::WallTime::now().toNSec());
  goal.goal.question = text.data.substr(0, replay::kLongestQuestion + 1);
  goals_.publish(goal);
}

void AskNode::onGoal(const AskGoalConstPtr& goal) {
  is_answering_ = true;
  try {
    const AskResult result = answer(goal->question);
    ROS_INFO_STREAM(result.why << ": " << result.sentence);
    server_.isPreemptRequested() ? server_.setPreempted(result) : server_.setSucceeded(result);
  } catch (const std::exception& error) {
    ROS_ERROR_STREAM("not answered: " << error.what());
    server_.setAborted({}, error.what());
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    quiet_from_ = std::max(quiet_from_, ros::WallTime::now() + ros::WallDuration(kEcho));
  }
  is_answering_ = false;
}

AskResult AskNode::answer(const std::string& question) {
  // Opened for each question: what other processes recorded meanwhile is there.
  const auto store = replay::openStore(options_.store, replay::OpenMode::ReadOnly);
  replay::BehaviorFilter newest;
  newest.limit = kRemembered;
  const auto said = [&](const replay::Behavior& behavior) {
    return replay::saidIn(*store, behavior);
  };
  const replay::AskAnswer answer =
      asking_.ask(question, store->behaviors(newest), said, replay::wallNow());
  AskResult result;
  result.answer = kindOf(answer);
  result.sentence = answer.sentence;
  result.why = answer.why;
  const bool is_found = answer.kind == replay::AskAnswer::Kind::Found;
  result.behavior_id = is_found ? answer.behavior.id : 0;
  if (!is_found || answer.in_words || !replay(answer, result)) say(result.sentence);
  return result;
}

/// False, with the result as it was, where no player replays it: it is told then.
bool AskNode::replay(const replay::AskAnswer& answer, AskResult& result) {
  if (!player_.waitForServer(kPlayerPatience)) return false;
  const std::string behavior = std::to_string(answer.behavior.id);
  result.moved = mayMove(answer);
  if (result.moved) say("Let me show you.");  // the way to the start may take a minute
  bool is_replayed = replayOnce(behavior, result.moved);
  if (result.moved && !is_replayed && wasRefused()) {
    result.moved = false;
    is_replayed = replayOnce(behavior, false);
  }
  if (is_replayed) result.answer = AskResult::REPLAYED;
  result.moved = result.moved && is_replayed;
  return is_replayed || server_.isPreemptRequested();
}

/// Replays to the end. Light and speech need no body: they can be replayed where motion is refused.
bool AskNode::replayOnce(const std::string& behavior, bool moves) {
  ReplayGoal goal;
  goal.behavior = behavior;
  if (!moves) goal.options = {"only=ar,speech"};
  player_.sendGoal(goal);
  while (ros::ok() && !player_.waitForResult(ros::Duration(0.1))) {
    if (!player_.isServerConnected()) return false;
    if (server_.isPreemptRequested()) player_.cancelGoal();
  }
  if (player_.getState() == actionlib::SimpleClientGoalState::SUCCEEDED) return true;
  ROS_WARN_STREAM("not replayed: " << player_.getState().getText());
  return false;
}

/// Returns true if the last replay never began. One that was stopped on its way does not go on in
/// light.
bool AskNode::wasRefused() {
  if (server_.isPreemptRequested() ||
      player_.getState() != actionlib::SimpleClientGoalState::ABORTED) {
    return false;
  }
  const ReplayResultConstPtr result = player_.getResult();
  return result && result->behavior_id == 0;
}

bool AskNode::mayMove(const replay::AskAnswer& answer) const {
  bool player_allows = false;
  ros::param::get(options_.player + "/allow_motion", player_allows);
  return answer.may_move && options_.allow_motion && player_allows;
}

void AskNode::say(const std::string& sentence) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const double seconds = static_cast<double>(sentence.size()) / kLettersPerSecond + kEcho;
    quiet_from_ = ros::WallTime::now() + ros::WallDuration(seconds);
  }
  sound_play::SoundRequest request;
  request.sound = sound_play::SoundRequest::SAY;
  request.command = sound_play::SoundRequest::PLAY_ONCE;
  request.volume = 1;
  request.arg = sentence;
  speech_.publish(request);
}

}  // namespace afterglow::nodes
