/// \file
/// The demo's calls to observer_node and speaker_node: what a bystander sees and hears, and the
/// film of it. Every method may throw TaskError, one line.
#pragma once

#include <ros/ros.h>

#include <string>

namespace afterglow::nodes {

/// Where the two nodes were told to write.
struct BystanderFiles {
  std::string silent_video;  ///< observer_node's ~video
  std::string speech_log;    ///< speaker_node's speech.json
};

class Bystander {
 public:
  explicit Bystander(const BystanderFiles& files);
  void waitUntilReady(double seconds);

  /// From which of the view file's other places; empty: from the usual one.
  void look(const std::string& place);
  void caption(const std::string& tag, const std::string& text);
  /// Saves the next picture as NAME.png, the projector's as NAME_projector.png.
  void takePicture(const std::string& name);
  /// Ends the film and gives it its sound.
  void finish(const std::string& video);

 private:
  BystanderFiles files_;
  ros::NodeHandle node_;
  ros::Publisher look_, caption_, key_frame_;
};

}  // namespace afterglow::nodes
