#include "nodes/speaker/speaker_node.hpp"

#include <ros/package.h>

#include <chrono>
#include <cmath>
#include <stdexcept>

namespace afterglow::nodes {
namespace {

using sound_play::SoundRequest;

constexpr double kTimerPeriod_s = 0.02;

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
  speech_ = std::make_unique<Speech>(options);
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
  requests_ = node.subscribe("/robotsound", 20, &SpeakerNode::onRequest, this,
                             ros::TransportHints().tcpNoDelay());
  timer_ = private_node.createSteadyTimer(ros::WallDuration(kTimerPeriod_s),
                                          [this](const ros::SteadyTimerEvent&) { onTimer(); });
}

void SpeakerNode::stop() { board_->stopAll(now()); }

void SpeakerNode::onRequest(const SoundRequest& request) {
  try {
    obey(request);
  } catch (const std::exception& error) {
    ROS_ERROR("sound request refused: %s", error.what());
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
  board_->play(keyOf(request), sound, loop, static_cast<double>(request.volume), now());
}

std::shared_ptr<const Sound> SpeakerNode::soundOf(const SoundRequest& request) {
  switch (request.sound) {
    case SoundRequest::SAY:
      return speech_->say(request.arg, request.arg2);
    case SoundRequest::PLAY_FILE:
      return std::make_shared<const Sound>(readWav(pathOf(request)));
    default:
      throw std::runtime_error("sound " + std::to_string(request.sound) +
                               ": only SAY and PLAY_FILE are available here");
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
  const std::string complaint = device_ ? device_->complaint() : "";
  if (!complaint.empty()) {
    ROS_WARN("nothing can be heard: %s; going on in silence", complaint.c_str());
  }
}

void SpeakerNode::publishState() {
  std_msgs::String state;
  for (const PlayingSound& playing : board_->playing()) {
    if (playing.key.sound == SoundRequest::SAY) state.data = playing.key.arg;
  }
  if (state.data == state_) return;
  state_ = state.data;
  state_publisher_.publish(state);
}

}  // namespace afterglow::nodes
