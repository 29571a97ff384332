#include "nodes/projector/projector_output.hpp"

#include <sensor_msgs/CameraInfo.h>

#include <algorithm>
#include <utility>

#include "nodes/conversion/beam_markers.hpp"

namespace afterglow::nodes {
namespace {

calib::Lens lensOf(const OutputConfig& config) {
  calib::CameraInfoFile file = loadLens(config);
  if (!file.warning.empty()) ROS_WARN("%s: %s", config.camera_info.c_str(), file.warning.c_str());
  return file.lens;
}

void makeBlack(render::Image& image, const calib::Lens& lens) {
  image.width = lens.width;
  image.height = lens.height;
  image.rgb.assign(3 * static_cast<std::size_t>(lens.width) * static_cast<std::size_t>(lens.height),
                   0);
}

/// The lens of a picture that is sent mirrored: its pixels lie the other way round.
sensor_msgs::CameraInfo toSentInfo(const calib::Lens& lens, render::Mirror mirror) {
  using render::Mirror;
  sensor_msgs::CameraInfo info = toCameraInfo(lens);
  const auto turnRound = [&info](std::size_t row, int pixels) {
    for (std::size_t column = 0; column < 3; ++column) {
      double& k = info.K[3 * row + column];
      k = column == 2 ? pixels - 1 - k : -k;
      info.P[4 * row + column] = k;
    }
  };
  if (mirror == Mirror::Horizontal || mirror == Mirror::Both) turnRound(0, lens.width);
  if (mirror == Mirror::Vertical || mirror == Mirror::Both) turnRound(1, lens.height);
  return info;
}

}  // namespace

ProjectorOutput::ProjectorOutput(const OutputConfig& config, const ros::NodeHandle& own,
                                 double beam_m, bool is_blended)
    : config_(config),
      lens_(lensOf(config)),
      light_(config.light, lens_, is_blended),
      counter_(lens_) {
  ros::NodeHandle nh(own, config.name);
  image_publisher_ = nh.advertise<sensor_msgs::Image>("image", 2);
  camera_info_publisher_ = nh.advertise<sensor_msgs::CameraInfo>("camera_info", 2, true);
  message_ = toImage({lens_.width, lens_.height, {}});
  message_.header.frame_id = config.frame;
  if (beam_m <= 0) return;
  beam_publisher_ = nh.advertise<visualization_msgs::MarkerArray>("beam", 1, true);
  const std::string name = config.name.empty() ? "beam" : config.name;
  beam_publisher_.publish(beamMarkers(lens_, config.frame, name, beam_m));
}

// ---------------------------------------------------------------------------------------- drawing

void ProjectorOutput::startDrawing(render::GlContext& context) {
  renderer_ = std::make_unique<render::ProjectorRenderer>(context, lens_, config_.drawing);
  const std::lock_guard<std::mutex> lock(mutex_);
  description_ = renderer_->description();
}

void ProjectorOutput::beginDrawing(const render::Scene& scene,
                                   const std::optional<Rigid<Projector, World>>& T_projector_world,
                                   const std::vector<render::AvoidedPoints>* avoided) {
  Lap lap;
  T_projector_world_ = T_projector_world;
  is_masked_ = T_projector_world && avoided != nullptr;
  if (T_projector_world) {
    renderer_->begin(scene, *T_projector_world);
    if (!config_.light.textures.empty()) surfaces_ = scene.surfaces;
  }
  if (is_masked_) {
    if (!mask_) mask_ = std::make_unique<render::DarkMask>(lens_);
    mask_->draw(*avoided, *T_projector_world);
  }
  begun_in_ = lap.next();
}

void ProjectorOutput::finishDrawing(ros::Time now, std::int64_t drawing_ns,
                                    const render::PixelLight* light, StageTimes& times) {
  Lap lap;
  render::Image image;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::swap(image, spare_);
  }
  if (T_projector_world_) {
    renderer_->finish(image);
    if (is_masked_) mask_->apply(image);
    light_.apply(image, surfaces_, *T_projector_world_, light);
  } else {
    makeBlack(image, lens_);
  }
  if (!now.isZero()) {  // ROS time has an end
    const auto light_ns = now.toNSec() + static_cast<std::uint64_t>(config_.aheadNs(drawing_ns));
    now.fromNSec(std::min(light_ns, ros::TIME_MAX.toNSec()));
  }
  times.add(Stage::Drawn, begun_in_ + lap.next());
  publish(image, now);
  times.add(Stage::Published, lap.next());
  const std::lock_guard<std::mutex> lock(mutex_);
  description_ = renderer_->description();
  avoided_share_ = is_masked_ ? std::optional(mask_->share()) : std::nullopt;
  if (T_projector_world_) textures_ = light_.textureReports();
  if (picture_) spare_ = std::move(*picture_);
  picture_ = std::move(image);
}

void ProjectorOutput::takeCensus(const render::Scene& scene,
                                 const std::optional<Rigid<Projector, World>>& T_projector_world) {
  const auto now = std::chrono::steady_clock::now();
  if (T_projector_world && now - counted_at_ < std::chrono::seconds(1)) return;
  std::vector<render::LayerCensus> census;
  if (T_projector_world) {
    counted_at_ = now;
    census = counter_.count(scene, *T_projector_world);
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  census_ = std::move(census);
}

void ProjectorOutput::stopDrawing() { renderer_.reset(); }

void ProjectorOutput::publish(render::Image& image, ros::Time drawn_for) {
  message_.header.stamp = drawn_for;
  sensor_msgs::CameraInfo info = toSentInfo(lens_, config_.light.mirror);
  info.header = message_.header;
  camera_info_publisher_.publish(info);
  if (image_publisher_.getNumSubscribers() == 0) return;
  // Lent, not copied: publishing by reference is done with the pixels when it returns.
  message_.data.swap(image.rgb);
  image_publisher_.publish(message_);
  message_.data.swap(image.rgb);
}

void ProjectorOutput::publishBlack() {
  render::Image image = black();
  publish(image, ros::Time::now());
}

// ----------------------------------------------------------------------------------------- window

std::optional<render::Image> ProjectorOutput::takePicture() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(picture_, std::nullopt);
}

void ProjectorOutput::giveBack(render::Image&& picture) {
  const std::lock_guard<std::mutex> lock(mutex_);
  spare_ = std::move(picture);
}

render::Image ProjectorOutput::black() const {
  render::Image image;
  makeBlack(image, lens_);
  return image;
}

void ProjectorOutput::setWindowProblem(const std::string& problem) {
  const std::lock_guard<std::mutex> lock(mutex_);
  window_problem_ = problem;
}

std::string ProjectorOutput::windowProblem() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return window_problem_;
}

std::vector<render::LayerCensus> ProjectorOutput::census() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return census_;
}

std::optional<double> ProjectorOutput::avoidedShare() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return avoided_share_;
}

std::vector<render::TextureReport> ProjectorOutput::textures() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return textures_;
}

std::string ProjectorOutput::renderer() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return description_;
}

}  // namespace afterglow::nodes
