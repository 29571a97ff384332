#include "nodes/speaker/speaker_node.hpp"

#include <ros/package.h>
#include <std_msgs/Float64.h>

#include <boost/function.hpp>
#include <chrono>
#include <cmath>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "nodes/conversion/sound_request.hpp"
#include "nodes/speaker/sound.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {
namespace {

/// Breaks lines between words, where they would become longer than so many bytes.
std::string inLines(const std::string& text, int longest) {
  std::istringstream words(text);
  std::string lines, line;
  for (std::string word; words >> word;) {
    const bool fits =
        line.empty() || line.size() + 1 + word.size() <= static_cast<std::size_t>(longest);
    if (!fits) lines += line + "\n";
    line = (fits && !line.empty() ? line + " " : "") + word;
  }
  return lines + line;
}

}  // namespace

std::unique_ptr<FloorCaption> FloorCaption::read(ros::NodeHandle node,
                                                 const ros::NodeHandle& private_node) {
  const auto topic = private_node.param<std::string>("caption_topic", "");
  if (topic.empty()) return nullptr;
  std::unique_ptr<FloorCaption> caption(new FloorCaption);
  visualization_msgs::Marker& marker = caption->marker_;
  marker.header.frame_id = private_node.param<std::string>("caption_frame", "map");
  const auto position =
      private_node.param<std::vector<double>>("caption_position", std::vector<double>(3, 0.0));
  if (position.size() != 3) throw std::runtime_error("~caption_position is not three numbers");
  marker.pose.position.x = position[0];
  marker.pose.position.y = position[1];
  marker.pose.position.z = position[2];
  marker.scale.z = private_node.param("caption_height", 0.08);
  if (!(marker.scale.z > 0) || !std::isfinite(marker.scale.z)) {
    throw std::runtime_error("~caption_height is no height");
  }
  caption->longest_line_ = private_node.param("caption_line", caption->longest_line_);
  if (caption->longest_line_ < 1) throw std::runtime_error("~caption_line is below 1");
  marker.ns = "speech";
  marker.type = visualization_msgs::Marker::TEXT_VIEW_FACING;
  marker.pose.orientation.w = 1;
  marker.color.r = marker.color.g = marker.color.b = marker.color.a = 1;
  caption->publisher_ = node.advertise<visualization_msgs::Marker>(topic, 2, true);
  return caption;
}

void FloorCaption::show(const std::string& text) {
  marker_.action =
      text.empty() ? visualization_msgs::Marker::DELETE : visualization_msgs::Marker::ADD;
  marker_.text = inLines(text, longest_line_);
  publisher_.publish(marker_);
}

namespace {

using sound_play::SoundRequest;

constexpr double kTimerPeriod_s = 0.02;
constexpr double kLookPeriod_s = 2, kMasterAnswers_s = 0.3;
constexpr double kEndless_s = 1e9;
constexpr std::size_t kMostAhead = 1000;

class Silence : public SoundOutput {
 public:
  void start(const PlayingSound& /*playing*/) override {}
  void stop(const PlayingSound& /*playing*/) override {}
};

SoundTime now() {
  const auto steady = std::chrono::steady_clock::now().time_since_epoch();
  return {static_cast<std::int64_t>(ros::Time::now().toNSec()),
          std::chrono::duration_cast<std::chrono::nanoseconds>(steady).count()};
}

/// Reads the request of a message of any publisher's definition.
std::optional<SoundRequest> requestOf(const ros::MessageEvent<const RawMessage>& event) {
  const ros::M_string& header = event.getConnectionHeader();
  const auto value = [&](const char* key) {
    const auto found = header.find(key);
    return found == header.end() ? std::string() : found->second;
  };
  const replay::Channel channel{"/robotsound",   value("type"),
                                value("md5sum"), value("message_definition"),
                                false,           event.getPublisherName()};
  return soundRequestOf(channel, event.getConstMessage()->bytes);
}

SoundKey keyOf(const SoundRequest& request) { return {request.sound, request.arg, request.arg2}; }

/// sound_play takes a path, a file URI, or a path within a package.
std::string pathOf(const SoundRequest& request) {
  const std::string uri = "file://";
  std::string path = request.arg.rfind(uri, 0) == 0 ? request.arg.substr(uri.size()) : request.arg;
  if (request.arg2.empty()) return path;
  const std::string package = ros::package::getPath(request.arg2);
  if (package.empty()) throw std::runtime_error("no package " + request.arg2 + " for " + path);
  return package + "/" + path;
}

}  // namespace

SpeakerNode::SpeakerNode(ros::NodeHandle node, ros::NodeHandle private_node) {
  SpeechOptions options;
  private_node.param("voice", options.voice, options.voice);
  private_node.param("words_per_minute", options.words_per_minute, options.words_per_minute);
  if (options.words_per_minute < 80 || options.words_per_minute > 450) {
    throw std::runtime_error("~words_per_minute is " + std::to_string(options.words_per_minute) +
                             "; 80 to 450 can be spoken");
  }
  options.engine = private_node.param<std::string>("engine", "auto");
  speech_ = std::make_unique<Speech>(options);
  ROS_INFO("speaks with %s", speech_->defaultVoice().c_str());
  const auto player = private_node.param<std::string>("player", "");
  if (player == "none") {
    silence_ = std::make_unique<Silence>();
  } else {
    device_ = std::make_unique<SoundDevice>(player);
  }
  SoundOutput& output = device_ ? static_cast<SoundOutput&>(*device_) : *silence_;
  board_ = std::make_unique<SoundBoard>(
      output, [this](const PlayingSound& playing) { onStarted(playing); },
      [this](const PlayingSound& playing, double heard_s) { onEnded(playing, heard_s); });
  const auto folder = private_node.param<std::string>("folder", "");
  if (!folder.empty()) log_ = std::make_unique<SpeechLog>(folder);
  state_publisher_ = private_node.advertise<std_msgs::String>("state", 10, true);
  state_publisher_.publish(std_msgs::String());
  duration_publisher_ = private_node.advertise<std_msgs::Float64>("duration", 10, true);
  duration_publisher_.publish(std_msgs::Float64());
  problem_publisher_ = node.advertise<std_msgs::String>("robotsound/problem", 100, true);
  problem_publisher_.publish(std_msgs::String());
  caption_ = FloorCaption::read(node, private_node);
  const auto subscribe = [&](const char* topic, auto callback) {
    return node.subscribe<RawMessage>(topic, 100,
                                      boost::function<void(const AnyMessage&)>(callback),
                                      ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
  };
  requests_ = subscribe("robotsound", [this](const AnyMessage& event) { onMessage(event); });
  ahead_requests_ =
      subscribe("robotsound/ahead", [this](const AnyMessage& event) { onAhead(event); });
  timer_ = private_node.createSteadyTimer(ros::WallDuration(kTimerPeriod_s),
                                          [this](const ros::SteadyTimerEvent&) { onTimer(); });
  look_timer_ = private_node.createSteadyTimer(
      ros::WallDuration(kLookPeriod_s),
      [this](const ros::SteadyTimerEvent&) { lookForSoundPlay(); });
  lookForSoundPlay();
}

void SpeakerNode::lookForSoundPlay() {
  std::string found;
  try {
    const RosGraph graph = askMaster(deadlineIn(kMasterAnswers_s));
    for (const std::string& node : graph.otherSubscribers(requests_.getTopic())) {
      if (isSoundPlay(node) && isAlive(node, deadlineIn(kMasterAnswers_s))) found = node;
    }
  } catch (const std::runtime_error&) {
    return;  // no master: as before
  }
  if (found == sound_play_) return;
  sound_play_ = found;
  if (found.empty()) {
    ROS_WARN("sound_play is gone: this node speaks");
  } else {
    ROS_WARN("sound_play (%s) speaks what /robotsound says: this node is silent, so that nothing "
             "is heard twice", found.c_str());
  }
}

void SpeakerNode::stop() { board_->stopAll(now()); }

void SpeakerNode::onMessage(const AnyMessage& event) {
  try {
    const std::optional<SoundRequest> request = requestOf(event);
    if (!request) throw std::runtime_error("it is no sound_play/SoundRequest");
    obey(*request);
    refusal_.clear();
  } catch (const std::exception& error) {
    refusal_ = error.what();
    ROS_ERROR("sound request refused: %s", error.what());
  }
  publishProblem();
}

void SpeakerNode::onAhead(const AnyMessage& event) {
  const std::optional<SoundRequest> request = requestOf(event);
  if (request && request->sound == SoundRequest::SAY && ahead_.size() < kMostAhead) {
    ahead_.push_back(*request);
  }
}

/// Prepares one sentence: a request that comes meanwhile does not wait for all of them.
void SpeakerNode::prepareOne() {
  if (ahead_.empty()) return;
  const SoundRequest request = ahead_.front();
  ahead_.pop_front();
  try {
    speech_->say(request.arg, request.arg2);
  } catch (const std::exception& error) {
    ROS_WARN("a sentence that will be asked for: %s", error.what());
  }
}

void SpeakerNode::obey(const SoundRequest& request) {
  if (request.command == SoundRequest::PLAY_STOP) {
    if (request.sound == SoundRequest::ALL) return board_->stopAll(now());
    return board_->stop(keyOf(request), now());
  }
  const bool loop = request.command == SoundRequest::PLAY_START;
  if (!loop && request.command != SoundRequest::PLAY_ONCE) {
    throw std::runtime_error("unknown command " + std::to_string(request.command));
  }
  if (!std::isfinite(request.volume)) throw std::runtime_error("its volume is not a number");
  const std::shared_ptr<const Sound> sound = soundOf(request);
  const double volume = sound_play_.empty() ? static_cast<double>(request.volume) : 0;
  board_->play(keyOf(request), sound, loop, volume, now());
}

std::shared_ptr<const Sound> SpeakerNode::soundOf(const SoundRequest& request) {
  switch (request.sound) {
    case SoundRequest::SAY:
      return speech_->say(request.arg, request.arg2);
    case SoundRequest::PLAY_FILE:
      return std::make_shared<const Sound>(readWav(pathOf(request)));
    default:
      if (auto sound = builtInSound(request.sound)) return sound;
      throw std::runtime_error("there is no sound " + std::to_string(request.sound));
  }
}

void SpeakerNode::onStarted(const PlayingSound& playing) {
  const bool says = playing.key.sound == SoundRequest::SAY;
  if (says) ROS_INFO("says: %s", playing.key.arg.c_str());
  publishState();
  if (!log_) return;
  const Utterance utterance{says ? playing.key.arg : "",
                            says ? playing.key.arg2 : "",
                            playing.onset.ros_ns,
                            playing.sound->seconds(),
                            playing.volume,
                            playing.loop,
                            ""};
  log_entries_[playing.id] = log_->add(utterance, *playing.sound);
}

void SpeakerNode::onEnded(const PlayingSound& playing, double heard_s) {
  publishState();
  const auto entry = log_entries_.find(playing.id);
  if (entry == log_entries_.end()) return;
  const bool as_planned = !playing.loop && heard_s >= playing.sound->seconds();
  if (!as_planned) log_->setDuration(entry->second, heard_s);
  log_entries_.erase(entry);
}

void SpeakerNode::onTimer() {
  try {
    board_->advance(now());
  } catch (const std::exception& error) {
    ROS_ERROR("%s", error.what());
  }
  publishProblem();
  prepareOne();
}

void SpeakerNode::publishProblem() {
  std_msgs::String problem;
  if (device_) problem.data = device_->problem();
  const bool is_silent = !problem.data.empty();
  if (!is_silent) problem.data = refusal_;
  if (problem.data == problem_) return;
  problem_ = problem.data;
  problem_publisher_.publish(problem);
  if (is_silent) ROS_WARN("nothing can be heard: %s; going on in silence", problem_.c_str());
}

void SpeakerNode::publishState() {
  std_msgs::String state;
  std_msgs::Float64 duration;
  for (const PlayingSound& playing : board_->playing()) {
    if (playing.key.sound != SoundRequest::SAY) continue;
    state.data = playing.key.arg;
    duration.data = playing.loop ? kEndless_s : playing.sound->seconds();
  }
  if (state.data == state_) return;
  state_ = state.data;
  duration_publisher_.publish(duration);  // first: who hears the state may know it then
  state_publisher_.publish(state);
  if (caption_) caption_->show(state_);
}

}  // namespace afterglow::nodes
