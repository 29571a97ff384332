#include "nodes/console/heard_robot.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>
#include <vector>

namespace afterglow::nodes {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kSilent = 3;  // diagnostic_msgs' STALE

std::int64_t steadyTime() {
  return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

bool isFresh(const HeardStatus& status, std::int64_t now_ns) {
  return now_ns - status.at_ns <= std::chrono::nanoseconds(HeardDiagnostics::kFresh).count();
}

/// "/layer" of "projector_node: /layer"; empty for others.
std::string layerOf(const HeardStatus& status) {
  const std::size_t at = status.name.find(": /");
  return at == std::string::npos ? "" : status.name.substr(at + 2);
}

}  // namespace

HeardDiagnostics::HeardDiagnostics() {
  subscriber_ = node_.subscribe<diagnostic_msgs::DiagnosticArray>(
      "/diagnostics", 50, [this](const auto& array) { hear(*array); });
}

void HeardDiagnostics::hear(const diagnostic_msgs::DiagnosticArray& array) {
  const std::int64_t now = steadyTime();
  const std::lock_guard<std::mutex> lock(mutex_);
  statuses_.forgetBefore(now - std::chrono::nanoseconds(kKept).count());
  for (const auto& status : array.status) statuses_.take(status, now);
}

Json HeardDiagnostics::all() const {
  const std::int64_t now = steadyTime();
  const std::lock_guard<std::mutex> lock(mutex_);
  auto list = Json::array();
  for (const auto& [name, status] : statuses_.all()) {
    const bool is_fresh = isFresh(status, now);
    const std::string words = (is_fresh ? "" : "not heard any more; last: ") + status.message;
    list.push_back(
        {{"name", name}, {"level", is_fresh ? status.level : kSilent}, {"words", words}});
  }
  return list;
}

Json HeardDiagnostics::projector() const {
  const std::int64_t now = steadyTime();
  const std::lock_guard<std::mutex> lock(mutex_);
  std::string words;
  int level = 0;
  auto layers = Json::array();
  for (const auto& [name, status] : statuses_.all()) {
    if (status.hardware != "projector" || !isFresh(status, now)) continue;
    const std::string layer = layerOf(status);
    if (layer.empty()) {
      words += (words.empty() ? "" : "; ") + status.message;
      level = std::max<int>(level, status.level);
    } else {
      layers.push_back({{"topic", layer},
                        {"hz", std::round(std::max(0.0, status.received_hz) * 10) / 10},
                        {"shown", status.number("shown") > 0},
                        {"words", status.message}});
    }
  }
  if (words.empty() && layers.empty()) {
    words = "no projector is heard";
    level = kSilent;
  }
  return {{"layers", layers}, {"level", level}, {"words", words}};
}

Json HeardDiagnostics::recorder() const {
  const std::int64_t now = steadyTime();
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const auto& [name, status] : statuses_.all()) {
    if (status.hardware != "recorder" || !isFresh(status, now)) continue;
    return {{"words", status.message + "; " + status.value("messages_per_s") +
                          " messages a second, " + status.value("dropped") + " lost"},
            {"recording", status.number("behaviors") > 0},
            {"messages", status.number("messages")},
            {"lost", status.number("dropped")},
            {"store", status.value("store")}};
  }
  return Json::object();
}

namespace {

constexpr int kQuality = 80, kWidest = 1280;
// Shorter than the timer's period: no two questions at once.
constexpr double kMasterPatience_s = 0.5;

/// Returns the pixels as OpenCV writes them, a wide image smaller; throws HttpError 503 for what is
/// no such image.
cv::Mat pixelsOf(const sensor_msgs::Image& image) {
  const bool is_rgb = image.encoding == "rgb8", is_gray = image.encoding == "mono8";
  if (!is_rgb && !is_gray && image.encoding != "bgr8") {
    throw HttpError(503, "images of encoding '" + image.encoding + "' are not shown");
  }
  const std::size_t row = std::size_t{image.width} * (is_gray ? 1 : 3);
  const bool is_whole = image.width > 0 && image.height > 0 && image.width <= 1U << 14 &&
                        image.height <= 1U << 14 && image.step >= row &&
                        image.data.size() >= std::size_t{image.step} * image.height;
  if (!is_whole) throw HttpError(503, "the image is damaged");
  const cv::Mat given(static_cast<int>(image.height), static_cast<int>(image.width),
                      is_gray ? CV_8UC1 : CV_8UC3, const_cast<unsigned char*>(image.data.data()),
                      image.step);
  cv::Mat pixels = given;
  if (is_rgb) cv::cvtColor(given, pixels, cv::COLOR_RGB2BGR);
  if (pixels.cols > kWidest) {
    cv::resize(pixels, pixels, {kWidest, std::max(1, kWidest * pixels.rows / pixels.cols)}, 0, 0,
               cv::INTER_AREA);
  }
  return pixels;
}

}  // namespace

ProjectedImage::ProjectedImage(const std::string& topic) : topic_(ros::names::resolve(topic)) {
  timer_ = node_.createWallTimer(ros::WallDuration(1), [this](const auto&) { look(); });
}

void ProjectedImage::hear(const sensor_msgs::ImageConstPtr& image) {
  const std::lock_guard<std::mutex> lock(mutex_);
  image_ = image;
  heard_ = std::chrono::steady_clock::now();
}

void ProjectedImage::look() {
  std::optional<RosGraph> graph;
  try {
    graph = master_.graph(deadlineIn(kMasterPatience_s));
  } catch (const std::runtime_error&) {  // without a master publishers go on
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  if (graph) is_published_ = !graph->otherPublishers(topic_).empty();
  if (std::chrono::steady_clock::now() - asked_ <= kPatience) return;
  subscriber_ = ros::Subscriber();
  image_ = nullptr;
}

nlohmann::ordered_json ProjectedImage::state() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return {{"topic", topic_}, {"published", is_published_}};
}

HttpResponse ProjectedImage::newest() {
  sensor_msgs::ImageConstPtr image;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const Time now = std::chrono::steady_clock::now();
    asked_ = now;
    if (!subscriber_) {
      subscribed_ = now;
      subscriber_ = node_.subscribe<sensor_msgs::Image>(
          topic_, 1, [this](const sensor_msgs::ImageConstPtr& heard) { hear(heard); });
    }
    if (image_ && now - heard_ <= kFresh) image = image_;
    if (!image && is_published_ && now - subscribed_ <= kFresh) return {204, "", ""};
  }
  if (!image) throw HttpError(503, "no image comes on " + topic_);
  std::vector<unsigned char> jpeg;
  cv::imencode(".jpg", pixelsOf(*image), jpeg, {cv::IMWRITE_JPEG_QUALITY, kQuality});
  return {200, "image/jpeg", std::string(jpeg.begin(), jpeg.end())};
}

}  // namespace afterglow::nodes
