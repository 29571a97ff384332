#include "nodes/calibrator/calibrator_voice.hpp"

#include <sound_play/SoundRequest.h>
#include <std_msgs/String.h>

namespace afterglow::nodes {
namespace {

std_msgs::String stringMessage(const std::string& text) {
  std_msgs::String message;
  message.data = text;
  return message;
}

}  // namespace

CalibratorVoice::CalibratorVoice(bool is_spoken) : is_spoken_(is_spoken) {
  guidance_ = own_.advertise<std_msgs::String>("guidance", 20, true);
  status_ = own_.advertise<std_msgs::String>("status", 20, true);
  if (is_spoken_) sound_ = nh_.advertise<sound_play::SoundRequest>("/robotsound", 20);
}

void CalibratorVoice::say(const calib::Utterance& utterance, const std::string& progress) {
  const std::string written =
      utterance.is_advice ? utterance.text + " (" + progress + ")" : utterance.text;
  guidance_.publish(stringMessage(written));
  ROS_INFO("%s", written.c_str());
  if (!is_spoken_ || !utterance.is_spoken) return;
  sound_play::SoundRequest request;
  request.sound = sound_play::SoundRequest::SAY;
  request.command = sound_play::SoundRequest::PLAY_ONCE;
  request.volume = 1;
  request.arg = utterance.text;
  sound_.publish(request);
}

void CalibratorVoice::showStatus(const std::string& json) {
  if (json == last_status_) return;
  last_status_ = json;
  status_.publish(stringMessage(json));
}

void CalibratorVoice::complain(const std::string& problem) {
  if (problem == last_problem_) return;
  last_problem_ = problem;
  if (problem.empty()) return;
  guidance_.publish(stringMessage(problem));
  ROS_WARN("%s", problem.c_str());
}

}  // namespace afterglow::nodes
