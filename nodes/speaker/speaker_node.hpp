/// \file
/// Replaces sound_play where it is absent: plays the requests on /robotsound, also those of older
/// definitions. Source of semantics: audio_common/sound_play, soundplay_node.py.
///
/// The spoken text as a text marker for a projector, for those who cannot hear it.
#pragma once

#include <ros/ros.h>
#include <sound_play/SoundRequest.h>
#include <std_msgs/String.h>
#include <visualization_msgs/Marker.h>

#include <deque>
#include <map>
#include <memory>
#include <string>

#include "nodes/conversion/typed_message.hpp"
#include "nodes/speaker/sound.hpp"
#include "nodes/speaker/sound_board.hpp"
#include "nodes/speaker/speech.hpp"

namespace afterglow::nodes {

/// Topic: ~caption_topic (visualization_msgs/Marker, TEXT_VIEW_FACING). Parameters: ~caption_topic
/// ("": none), ~caption_frame (map), ~caption_position ([0, 0, 0], m), ~caption_height (0.08, m, of
/// a capital), ~caption_line (40, letters; longer ones are broken between words).
class FloorCaption {
 public:
  /// Empty without a topic. Throws std::runtime_error for a parameter that cannot be obeyed.
  static std::unique_ptr<FloorCaption> read(ros::NodeHandle node,
                                            const ros::NodeHandle& private_node);

  /// An empty text removes the caption.
  void show(const std::string& text);

 private:
  FloorCaption() = default;

  visualization_msgs::Marker marker_;
  int longest_line_ = 40;
  ros::Publisher publisher_;
};

/// Topics, in: /robotsound (sound_play/SoundRequest of any definition); /robotsound/ahead,
/// sentences that will be requested: prepared in idle time, so that they start at once. Out,
/// latched: ~state (std_msgs/String), the text being said, empty when it has been said; ~duration
/// (std_msgs/Float64), how many seconds it takes in all, 0 when it has been said, 1e9 in a loop;
/// /robotsound/problem (std_msgs/String), why nothing can be heard or the last request was refused,
/// empty: all is well. Parameters: ~voice (en-us), ~engine (auto: speech.hpp),
/// ~words_per_minute (160), ~player ("": aplay or paplay, whichever is there; "none": silent),
/// ~folder ("": keep nothing; else a WAV file for every sound and speech.json), and those of
/// FloorCaption. While sound_play runs, it alone is heard: this node is silent, and warns. The
/// constructor throws std::runtime_error for a parameter that cannot be obeyed.
class SpeakerNode {
 public:
  SpeakerNode(ros::NodeHandle node, ros::NodeHandle private_node);

  /// Stops all sounds; the log then has their durations.
  void stop();

 private:
  using AnyMessage = ros::MessageEvent<const RawMessage>;

  void onMessage(const AnyMessage& event);
  void onAhead(const AnyMessage& event);
  void obey(const sound_play::SoundRequest& request);
  std::shared_ptr<const Sound> soundOf(const sound_play::SoundRequest& request);
  void onStarted(const PlayingSound& playing);
  void onEnded(const PlayingSound& playing, double heard_s);
  void onTimer();
  void prepareOne();
  void lookForSoundPlay();
  void publishProblem();
  void publishState();

  std::unique_ptr<Speech> speech_;
  std::unique_ptr<SoundDevice> device_;  ///< declared before the board that plays on it
  std::unique_ptr<SoundOutput> silence_;
  std::unique_ptr<SoundBoard> board_;
  std::unique_ptr<SpeechLog> log_;          ///< empty without ~folder
  std::map<int, std::size_t> log_entries_;  ///< entries of playing sounds, by their id
  std::unique_ptr<FloorCaption> caption_;   ///< empty without ~caption_topic
  std::string state_, problem_;
  std::string sound_play_;  ///< the node that speaks instead; empty: there is none
  std::string refusal_;     ///< refusal of the last request; empty if it was obeyed
  std::deque<sound_play::SoundRequest> ahead_;
  ros::Publisher state_publisher_, duration_publisher_, problem_publisher_;
  ros::Subscriber requests_, ahead_requests_;
  ros::SteadyTimer timer_, look_timer_;
};

}  // namespace afterglow::nodes
