/// \file
/// A video whose time is ROS time, with the sound of what was said meanwhile.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nodes/tools/video_writer.hpp"
#include "render/scene/image.hpp"

namespace afterglow::nodes {

/// Images at a constant rate from the first one on. An image that comes late leaves gaps before it,
/// which repeat the one before. Errors are VideoWriter's.
class Film {
 public:
  /// `speech_logs`: SpeechLog's speech.json files, whose sounds come in at their moments, as loud
  /// as spoken video usually is; none, or empty names: the film is silent.
  Film(const std::string& path, int width, int height, int fps,
       std::vector<std::string> speech_logs = {});

  /// Shows the image from its moment on. Ignored if its place has already been written. Throws
  /// std::runtime_error if ROS time has jumped ahead by more than an hour.
  void add(std::int64_t ros_ns, render::Image image);
  /// Repeats the last image until `ros_ns` and finishes the film, which is either whole or not
  /// there. A film without an image is an error. Where its sound cannot be made, the error says
  /// where the film without sound is: what was filmed cannot be filmed again.
  void close(std::int64_t ros_ns);
  std::int64_t begin() const { return begin_ns_; }  ///< ROS time of the first image

 private:
  std::int64_t indexAt(std::int64_t ros_ns) const;
  void repeatUntil(std::int64_t index);

  std::string path_, silent_path_;
  std::vector<std::string> speech_logs_;
  int fps_;
  std::int64_t begin_ns_ = 0;  ///< ROS time of the first image
  std::int64_t count_ = 0;     ///< images written
  VideoWriter writer_;
  std::optional<render::Image> last_;
};

}  // namespace afterglow::nodes
