/// \file
/// observer_node: the room as a bystander sees it, as a video, as image files and on a topic.
///
/// Subscribes to /room/solids (MarkerArray), /projector/image and /projector/camera_info, /tf,
/// ~caption (std_msgs/String: "TEXT" or "TAG|TEXT"), /speaker_node/state (what is being said),
/// ~asked (std_msgs/String: what a human asks, shown and heard in the film until the next caption),
/// ~look (std_msgs/String: goes over to that place of the view's `others`, empty: back),
/// ~key_frame (std_msgs/String: saves the next image as FOLDER/NAME.png and the projector's as
/// FOLDER/NAME_projector.png). Publishes ~image (rgb8, while somebody listens). Service ~finish
/// (std_srvs/Trigger): ends the film; it answers when the film is in place. The robot comes from
/// the parameter /robot_description, as soon as it is there.
#pragma once

#include <ros/ros.h>
#include <std_srvs/Trigger.h>
#include <tf2_ros/buffer.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nodes/observer/darkroom.hpp"
#include "nodes/observer/observer_scene.hpp"
#include "nodes/observer/room_view.hpp"
#include "nodes/projector/transform_listener.hpp"
#include "nodes/speaker/speech.hpp"
#include "nodes/speaker/speech_log.hpp"

namespace afterglow::nodes {

/// Parameters of the same names.
struct ObserverNodeOptions {
  std::string view;    ///< loadRoomView's file
  std::string video;   ///< MP4 to write; empty: none
  std::string speech;  ///< speaker_node's speech.json, for the video's sound; empty: silent
  std::string human_voice = "en-gb+f3";  ///< eSpeak NG's, for what is asked
  std::string folder;  ///< for key frames; empty: the current one
  int fps = 25;
  bool inset = true;  ///< the projector's image in a corner
  std::string font = CaptionPainter::defaultFont();

  /// Throws std::runtime_error naming the parameter that is missing or wrong.
  static ObserverNodeOptions read(const ros::NodeHandle& own);
};

/// Everything in the thread that constructs and runs it, but what the darkroom draws; no spinner is
/// needed.
class ObserverNode {
 public:
  /// Throws std::runtime_error: view, font, OpenGL or ffmpeg, and why.
  explicit ObserverNode(const ObserverNodeOptions& options);

  /// Draws at absolute deadlines until `is_stopped`, then finishes the video. The video begins when
  /// something stands in the room; if nothing ever does, that is an error. Throws
  /// std::runtime_error if the video cannot be written.
  void run(const std::function<bool()>& is_stopped);

 private:
  ObserverNode(const ObserverNodeOptions& options, const RoomView& room);
  void subscribe();
  void onKeyFrame(const std::string& name);
  void onLook(const std::string& name);
  bool onFinish(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response);
  void hearNews();
  Look lookAt(ros::Time now) const;
  void lookForRobot();
  bool isWatched() const;
  void onAsked(const std::string& question);
  DarkroomOptions darkroomOptions();
  Shot shoot(ros::Time now);
  void publish(std::int64_t ros_ns, const render::Image& image) const;

  ObserverNodeOptions options_;
  ros::NodeHandle own_{"~"};
  tf2_ros::Buffer tf_;
  TransformListener tf_listener_{tf_};
  RoomView room_;
  Look look_from_, look_to_;  ///< on the way from one to the other
  ros::Time look_changed_;
  ObserverScene scene_;
  std::unique_ptr<SpeechLog> asked_;  ///< what was asked in the film; empty without one
  std::unique_ptr<Speech> human_;     ///< made when it is first needed
  std::string unheard_;               ///< why a question in the film has no sound; empty: all have
  bool has_film_, is_filming_ = false;  ///< the video is not yet finished, has begun
  Caption caption_;
  std::vector<std::string> key_frames_;  ///< to save with the next image
  ros::WallTime next_robot_look_;
  ros::Publisher image_publisher_;
  std::unique_ptr<Darkroom> darkroom_;
  std::vector<ros::Subscriber> subscribers_;
  ros::ServiceServer finish_;
};

}  // namespace afterglow::nodes
