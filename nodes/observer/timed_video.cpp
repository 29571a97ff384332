#include "nodes/observer/timed_video.hpp"

#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "calib/file_replacement.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kLongestGap_s = 3600;

}  // namespace

VideoInfo readVideoInfo(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot read");
  try {
    const auto json = nlohmann::json::parse(file);
    const VideoInfo info{json.at("first_frame_ns").get<std::int64_t>(), json.at("fps").get<int>(),
                         json.at("frames").get<std::int64_t>()};
    if (info.fps <= 0 || info.frames <= 0) {
      throw std::runtime_error(path + ": fps and frames should be positive");
    }
    return info;
  } catch (const nlohmann::json::exception& error) {
    throw std::runtime_error(path + ": does not describe a video: " + error.what());
  }
}

TimedVideo::TimedVideo(const std::string& path, int width, int height, int fps)
    : path_(path), info_{0, fps, 0}, writer_(path, width, height, fps) {}

std::int64_t TimedVideo::nextFrameNs() const {
  if (!last_) return 0;
  // The whole product first: no rounding adds up over the frames.
  return info_.first_frame_ns + info_.frames * kSecond / info_.fps;
}

std::int64_t TimedVideo::indexAt(std::int64_t ros_ns) const {
  // Half a frame's grace: a picture made just before its moment belongs to it.
  return ((ros_ns - info_.first_frame_ns) * info_.fps + kSecond / 2) / kSecond;
}

void TimedVideo::add(std::int64_t ros_ns, render::Image image) {
  if (!last_) info_.first_frame_ns = ros_ns;
  const std::int64_t index = indexAt(ros_ns);
  if (index < info_.frames || ros_ns < info_.first_frame_ns) return;
  if (index - info_.frames > kLongestGap_s * info_.fps) {
    throw std::runtime_error(path_ + ": ROS time has jumped ahead by more than an hour");
  }
  repeatUntil(index);
  writer_.write(image);
  ++info_.frames;
  last_ = std::move(image);
}

void TimedVideo::repeatUntil(std::int64_t index) {
  for (; last_ && info_.frames < index; ++info_.frames) writer_.write(*last_);
}

void TimedVideo::close(std::int64_t ros_ns) {
  if (last_ && ros_ns - nextFrameNs() < kLongestGap_s * kSecond) repeatUntil(indexAt(ros_ns));
  writer_.close();
  const nlohmann::ordered_json json = {
      {"first_frame_ns", info_.first_frame_ns}, {"fps", info_.fps}, {"frames", info_.frames}};
  // Others wait for this file: it appears whole.
  calib::replaceFile(path_ + ".json", json.dump(2) + "\n");
}

}  // namespace afterglow::nodes
