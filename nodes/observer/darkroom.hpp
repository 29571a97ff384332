/// \file
/// Draws shots one after the other in a thread of its own, with a low priority: what there is
/// no time for beside a simulation is drawn after it. OpenGL is used in that thread alone.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "nodes/observer/film.hpp"
#include "nodes/observer/shot.hpp"

namespace afterglow::nodes {

struct DarkroomOptions {
  int width = 0, height = 0;  ///< of the images; their strip comes below
  int fps = 25;
  std::string video;                 ///< MP4 to write; empty: none
  std::vector<std::string> speech;   ///< speech.json files, for its sound
  std::string folder;                ///< for key frames
  std::string font;
  bool has_inset = true;
  /// Called in the darkroom's thread with each finished image.
  std::function<void(std::int64_t ros_ns, const render::Image&)> on_image = nullptr;
};

class Darkroom {
 public:
  /// Throws std::runtime_error: OpenGL, font or ffmpeg, and why.
  explicit Darkroom(DarkroomOptions options);
  /// What has not been drawn is dropped; without finish() there is no film.
  ~Darkroom();
  Darkroom(const Darkroom&) = delete;
  Darkroom& operator=(const Darkroom&) = delete;

  /// Where too many wait, some are left out: the film then shows the one before for longer. Throws
  /// what went wrong with an earlier one.
  void add(Shot shot);
  bool isIdle();
  /// Waits until all are drawn and ends the film; its first image's ROS time. Throws
  /// std::runtime_error: the film cannot be written, or there is none.
  std::int64_t finish(std::int64_t ros_ns);

 private:
  struct Tools;
  void run();
  bool takeNext(Shot& shot);
  void draw(Tools& tools, Shot& shot);
  void saveKeyFrames(const Shot& shot, const render::Image& image) const;

  DarkroomOptions options_;
  std::mutex mutex_;
  std::condition_variable news_;
  std::deque<Shot> waiting_;
  std::unique_ptr<Film> film_;   ///< empty without one, or when it is finished
  std::exception_ptr error_;
  std::size_t added_ = 0;
  bool is_ready_ = false, is_drawing_ = false, is_ended_ = false;
  std::thread thread_;
};

}  // namespace afterglow::nodes
