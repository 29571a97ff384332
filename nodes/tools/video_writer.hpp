/// \file
/// Images into an MP4 file, through the ffmpeg command (H.264, yuv420p: every player shows it).
///
/// Room beside a file that is being made, for what it is made of.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "render/scene/image.hpp"

namespace afterglow::nodes {

/// The path of the unfinished video: beside `path`, with its ending, which tells ffmpeg the format.
std::string partPath(const std::string& path);

/// Writes to partPath(); close() renames the finished file, so that `path` is either whole or
/// untouched. Without close() no file is left. One thread at a time. Everything throws
/// std::runtime_error with the path and ffmpeg's own words.
class VideoWriter {
 public:
  /// Writes images of width x height pixels, `fps` a second (std::invalid_argument if one is not
  /// positive).
  VideoWriter(std::string path, int width, int height, int fps);
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  /// The next image; blocks while the encoder is behind. Throws std::invalid_argument for an image
  /// of another size.
  void write(const render::Image& image);
  /// Waits for the encoder and puts the file in place; a video without an image is an error. Call
  /// it once, as the last.
  void close();

 private:
  void start(int fps);
  std::vector<std::string> encoderCommand(int fps) const;
  [[noreturn]] void fail(const std::string& what);
  std::string encoderMessage() const;
  int waitForEncoder();

  std::string path_;
  std::string part_path_;
  int width_, height_;
  std::size_t images_ = 0;
  pid_t encoder_ = -1;
  int images_fd_ = -1;    ///< a socket, so that a dead encoder is an error here and no signal
  int messages_fd_ = -1;  ///< an unnamed file that catches ffmpeg's standard error
};

/// A new folder that only its owner can read, gone with the object.
class WorkFolder {
 public:
  /// Beside `file`; throws std::runtime_error naming the folder if it cannot be made.
  explicit WorkFolder(const std::string& file);
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  ~WorkFolder();

  std::string path(const std::string& name) const;
  /// A new folder in it.
  std::string folder(const std::string& name) const;

 private:
  std::string path_;
};

}  // namespace afterglow::nodes
