#include "nodes/console/projected_image.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>
#include <vector>

namespace afterglow::nodes {
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
