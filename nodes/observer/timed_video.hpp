/// \file
/// A video whose time is ROS time.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "nodes/tools/video_writer.hpp"
#include "render/scene/image.hpp"

namespace afterglow::nodes {

/// What VIDEO.json says of VIDEO: frame k shows the moment first_frame_ns + k / fps.
struct VideoInfo {
  std::int64_t first_frame_ns = 0;  ///< ROS time
  int fps = 0;
  std::int64_t frames = 0;

  double seconds() const { return static_cast<double>(frames) / fps; }
};

/// Throws std::runtime_error naming the file and what is wrong in it.
VideoInfo readVideoInfo(const std::string& path);

/// Frames at a constant rate from the first one on. A frame that comes late leaves gaps before it,
/// which repeat the picture before. Errors are VideoWriter's.
class TimedVideo {
 public:
  TimedVideo(const std::string& path, int width, int height, int fps);

  /// When the next frame is due, ROS time; 0 before the first.
  std::int64_t nextFrameNs() const;
  /// Shows the picture from its moment on. Ignored if its frame has already been written. Throws
  /// std::runtime_error if ROS time has jumped ahead by more than an hour.
  void add(std::int64_t ros_ns, render::Image image);
  /// Repeats the last picture until `ros_ns`, finishes the video and writes PATH.json beside it.
  /// A video without a frame is an error.
  void close(std::int64_t ros_ns);

 private:
  std::int64_t indexAt(std::int64_t ros_ns) const;
  void repeatUntil(std::int64_t index);

  std::string path_;
  VideoInfo info_;
  VideoWriter writer_;
  std::optional<render::Image> last_;
};

}  // namespace afterglow::nodes
