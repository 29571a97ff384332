#include "nodes/observer/observer_scene.hpp"

#include <sensor_msgs/image_encodings.h>

#include <stdexcept>
#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/observer/room_solids.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::int64_t kDarkAfterNs = 2'000'000'000;  // without a new image
constexpr std::size_t kMostWaiting = 8;

std::int64_t toNs(ros::Time time) { return static_cast<std::int64_t>(time.toNSec()); }

/// Rows without their padding. Empty if it is not rgb8 or its sizes do not fit.
std::optional<render::Image> imageOf(const sensor_msgs::Image& message) {
  const std::size_t row = std::size_t{message.width} * 3;
  const bool fits = message.encoding == sensor_msgs::image_encodings::RGB8 && message.width > 0 &&
                    message.height > 0 && message.step >= row &&
                    message.data.size() >= std::size_t{message.step} * message.height;
  if (!fits) return std::nullopt;
  render::Image image{static_cast<int>(message.width), static_cast<int>(message.height), {}};
  image.rgb.reserve(row * message.height);
  for (std::size_t y = 0; y < message.height; ++y) {
    const auto begin = message.data.begin() + static_cast<std::ptrdiff_t>(y * message.step);
    image.rgb.insert(image.rgb.end(), begin, begin + static_cast<std::ptrdiff_t>(row));
  }
  return image;
}

/// Negative focal lengths are those of a image that is sent mirrored (projector_node): what
/// mirror it is seen by, and K becomes that of the image behind it.
render::Mirror takeMirror(const sensor_msgs::CameraInfo& info, Eigen::Matrix3d& K) {
  const bool columns = K(0, 0) < 0, rows = K(1, 1) < 0;
  if (columns) K.row(0) = Eigen::RowVector3d(0, 0, info.width - 1.0) - K.row(0);
  if (rows) K.row(1) = Eigen::RowVector3d(0, 0, info.height - 1.0) - K.row(1);
  return columns ? (rows ? render::Mirror::Both : render::Mirror::Horizontal)
                 : (rows ? render::Mirror::Vertical : render::Mirror::None);
}

}  // namespace

ObserverScene::ObserverScene(RoomView room, const tf2::BufferCore& buffer)
    : room_(std::move(room)),
      frames_(buffer, room_.fixed_frame),
      solids_(roomSolidsConfig(room_.fixed_frame), buffer) {}

void ObserverScene::addSolids(const visualization_msgs::MarkerArray& solids, ros::Time now) {
  solids_.add(0, solids, now);
}

void ObserverScene::setLens(const sensor_msgs::CameraInfo& info) {
  Eigen::Matrix3d K = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(info.K.data());
  mirror_ = render::LightOutput({{}, 1, takeMirror(info, K)});
  try {
    lens_ = calib::makeLens(
        static_cast<int>(info.width), static_cast<int>(info.height), K, info.D,
        calib::lensModelNamed(info.distortion_model).value_or(calib::LensModel::BrownConrady));
  } catch (const std::invalid_argument&) {
    drop("camera_info is no lens");
  }
}

void ObserverScene::addImage(const sensor_msgs::Image& image) {
  auto pixels = imageOf(image);
  if (!pixels) return drop("the projector's image is not rgb8 or its size is wrong");
  newest_image_ = std::make_shared<const render::Image>(std::move(*pixels));
  waiting_.push_back({image.header, newest_image_});
  if (waiting_.size() > kMostWaiting) waiting_.pop_front();
}

bool ObserverScene::isFurnished() { return hasRobot() || solids_.status().front().shown > 0; }

std::vector<render::Drawable> ObserverScene::solids(ros::Time now) {
  frames_.forget();
  std::vector<render::Drawable> all = room_.shell;
  const auto add = [&all](const std::vector<render::Drawable>& more) {
    all.insert(all.end(), more.begin(), more.end());
  };
  add(solidsOf(solids_.snapshot(now).scene));
  if (robot_) add(robotSolids(*robot_, frames_));
  return all;
}

const render::ProjectedLight* ObserverScene::light(ros::Time now) {
  frames_.forget();
  for (std::size_t i = waiting_.size(); i-- > 0 && lens_;) {
    const std_msgs::Header& header = waiting_[i].header;
    const auto pose = frames_.at(frameName(header.frame_id), header.stamp);
    if (!pose) continue;
    throwLight(waiting_[i], *pose);
    // Newer images wait on for their transform.
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(i) + 1);
    break;
  }
  const bool lit = light_ns_ > 0 && toNs(now) - light_ns_ < kDarkAfterNs;
  return lit ? &light_ : nullptr;
}

void ObserverScene::throwLight(const ProjectedImage& projected,
                               const Eigen::Isometry3d& T_world_projector) {
  if (projected.image->width != lens_->width || projected.image->height != lens_->height) {
    return drop("the projector's image has not the size of its lens");
  }
  light_ = {*lens_, Rigid<World, Projector>(T_world_projector).inverse(), *projected.image};
  mirror_.apply(light_.image);
  light_ns_ = toNs(projected.header.stamp);
}

LayerStatus ObserverScene::status() const { return solids_.status().front(); }

}  // namespace afterglow::nodes
