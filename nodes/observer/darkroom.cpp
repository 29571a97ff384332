#include "nodes/observer/darkroom.hpp"

#include <ros/console.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <filesystem>
#include <stdexcept>
#include <utility>

#include "render/image_file.hpp"

namespace afterglow::nodes {
namespace {

/// From here on every second shot waits no more: a film is late by what a slow machine needs for
/// these, and they are kept in memory.
constexpr std::size_t kManyWaiting = 300;
constexpr int kLowPriority = 5;  // less would starve it where others compute, too

}  // namespace

/// What belongs to the thread.
struct Darkroom::Tools {
  explicit Tools(const std::string& font) : painter(font) {}
  render::GlContext context;
  render::ObserverRenderer renderer{context};
  CaptionPainter painter;
};

Darkroom::Darkroom(DarkroomOptions options) : options_(std::move(options)) {
  thread_ = std::thread([this] { run(); });
  std::unique_lock<std::mutex> lock(mutex_);
  news_.wait(lock, [this] { return is_ready_ || error_; });
  if (!error_) return;
  lock.unlock();
  thread_.join();
  std::rethrow_exception(error_);
}

Darkroom::~Darkroom() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_ended_ = true;
  }
  news_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Darkroom::add(Shot shot) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (error_) std::rethrow_exception(error_);
    if (waiting_.size() >= kManyWaiting && shot.key_frames.empty() && ++added_ % 2 == 0) return;
    waiting_.push_back(std::move(shot));
  }
  news_.notify_all();
}

bool Darkroom::isIdle() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return waiting_.empty() && !is_drawing_;
}

std::int64_t Darkroom::finish(std::int64_t ros_ns) {
  std::unique_lock<std::mutex> lock(mutex_);
  news_.wait(lock, [this] { return (waiting_.empty() && !is_drawing_) || error_; });
  if (error_) std::rethrow_exception(error_);
  if (!film_) throw std::runtime_error("there is no film");
  const std::unique_ptr<Film> film = std::move(film_);
  film->close(ros_ns);
  return film->begin();
}

void Darkroom::run() {
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), kLowPriority);
  try {
    Tools tools(options_.font);
    if (!options_.video.empty()) {
      film_ = std::make_unique<Film>(options_.video, options_.width,
                                     options_.height + stripHeight(options_.width), options_.fps,
                                     options_.speech);
    }
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      is_ready_ = true;
    }
    news_.notify_all();
    for (Shot shot; takeNext(shot);) draw(tools, shot);
  } catch (const std::exception&) {
    const std::lock_guard<std::mutex> lock(mutex_);
    error_ = std::current_exception();
    is_drawing_ = false;
  }
  news_.notify_all();
}

bool Darkroom::takeNext(Shot& shot) {
  std::unique_lock<std::mutex> lock(mutex_);
  is_drawing_ = false;
  if (waiting_.empty()) news_.notify_all();
  news_.wait(lock, [this] { return !waiting_.empty() || is_ended_; });
  if (is_ended_) return false;
  shot = std::move(waiting_.front());
  waiting_.pop_front();
  is_drawing_ = true;
  return true;
}

void Darkroom::draw(Tools& tools, Shot& shot) {
  render::Image image = paintShot(shot, tools.renderer, tools.painter, options_.width,
                                  options_.height, options_.has_inset);
  saveKeyFrames(shot, image);
  if (options_.on_image) options_.on_image(shot.ros_ns, image);
  if (shot.is_filmed && film_) film_->add(shot.ros_ns, std::move(image));
}

void Darkroom::saveKeyFrames(const Shot& shot, const render::Image& image) const {
  for (const std::string& name : shot.key_frames) {
    const std::string stem = (std::filesystem::path(options_.folder) / name).string();
    try {
      render::writePng(stem + ".png", image);
      if (shot.projected.width > 0) render::writePng(stem + "_projector.png", shot.projected);
    } catch (const std::runtime_error& error) {
      ROS_ERROR("%s", error.what());
    }
  }
}

}  // namespace afterglow::nodes
