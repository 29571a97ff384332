/// \file
/// Stands in for sound_play where it is absent: speaks what `/robotsound` says.
/// Source of semantics: audio_common/sound_play, soundplay_node.py.
#pragma once

#include <ros/ros.h>
#include <sound_play/SoundRequest.h>
#include <std_msgs/String.h>

#include <map>
#include <memory>
#include <set>
#include <string>

#include "nodes/speaker/sound_board.hpp"
#include "nodes/speaker/sound_device.hpp"
#include "nodes/speaker/speech.hpp"
#include "nodes/speaker/speech_log.hpp"

namespace afterglow::nodes {

/// Topics: in /robotsound (sound_play/SoundRequest); out ~state (std_msgs/String, latched): the
/// text being said, empty when it has been said. Parameters: ~voice (en-us), ~words_per_minute
/// (160), ~player ("": aplay or paplay, whichever is there; "none": silent), ~folder ("": keep
/// nothing; else a WAV file for every sound and speech.json). The constructor throws
/// std::runtime_error for a parameter that cannot be obeyed.
class SpeakerNode {
 public:
  SpeakerNode(ros::NodeHandle node, ros::NodeHandle private_node);

  /// Silence; the log then holds how long everything sounded.
  void stop();

 private:
  void onRequest(const sound_play::SoundRequest& request);
  void obey(const sound_play::SoundRequest& request);
  std::shared_ptr<const Sound> soundOf(const sound_play::SoundRequest& request);
  void onStarted(const PlayingSound& playing);
  void onEnded(const PlayingSound& playing, double heard_s);
  void onTimer();
  void publishState();

  std::unique_ptr<Speech> speech_;
  std::unique_ptr<SoundDevice> device_;  ///< declared before the board that plays on it
  std::unique_ptr<SoundOutput> silence_;
  std::unique_ptr<SoundBoard> board_;
  std::unique_ptr<SpeechLog> log_;          ///< empty without ~folder
  std::map<int, std::size_t> log_entries_;  ///< of playing sounds, by their id
  std::string state_;
  ros::Publisher state_publisher_;
  ros::Subscriber requests_;
  ros::SteadyTimer timer_;
};

}  // namespace afterglow::nodes
