#include "nodes/projector/projector_node.hpp"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <nav_msgs/Path.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/LaserScan.h>
#include <sensor_msgs/PointCloud2.h>
#include <visualization_msgs/Marker.h>
#include <visualization_msgs/MarkerArray.h>

#include <boost/make_shared.hpp>
#include <exception>
#include <future>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "calib/camera_info_file.hpp"
#include "nodes/projector/projector_messages.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::uint32_t kCloudQueue = 10, kMarkerQueue = 100;  // RViz's
const ros::Duration kJump(0.5);                                // less is a clock being set right

calib::Lens loadLens(const std::string& path) {
  calib::CameraInfoFile file = calib::loadCameraInfo(path);
  if (!file.warning.empty()) ROS_WARN("%s: %s", path.c_str(), file.warning.c_str());
  return file.lens;
}

}  // namespace

ProjectorNodeOptions ProjectorNodeOptions::read(const ros::NodeHandle& own) {
  ProjectorNodeOptions options;
  if (!own.getParam("config", options.config) || options.config.empty()) {
    throw std::runtime_error("parameter ~config is missing: the path of the configuration");
  }
  own.param("calibration", options.calibration, options.calibration);
  own.param("rate", options.rate_hz, options.rate_hz);
  if (!(options.rate_hz >= 0.1 && options.rate_hz <= 240)) {
    throw std::runtime_error("parameter ~rate should be from 0.1 to 240 Hz");
  }
  options.window = WindowChoice::read(own);
  return options;
}

ProjectorNode::ProjectorNode(const ProjectorNodeOptions& options)
    : options_(options),
      scene_(loadProjectorConfig(options.config, options.calibration), transforms_) {
  lens_ = loadLens(scene_.config().camera_info);
  image_publisher_ = own_.advertise<sensor_msgs::Image>("image", 2);
  camera_info_publisher_ = own_.advertise<sensor_msgs::CameraInfo>("camera_info", 2, true);
  diagnostics_publisher_ = nh_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 2);
  counted_at_ = std::chrono::steady_clock::now();
  subscribeAll();
  if (scene_.config().watch) {
    watch_ = std::make_unique<DriftWatch>(*scene_.config().watch, transforms_);
  }
  startDrawing();
  diagnostics_timer_ = nh_.createWallTimer(
      ros::WallDuration(1), [this](const ros::WallTimerEvent&) { publishDiagnostics(); });
}

ProjectorNode::~ProjectorNode() {
  is_stopping_ = true;
  if (drawing_.joinable()) drawing_.join();
}

// --------------------------------------------------------------------------------------------
// input
template <typename MessageType>
ros::Subscriber ProjectorNode::subscribe(std::size_t layer, std::uint32_t queue) {
  const auto callback = [this, layer](const boost::shared_ptr<const MessageType>& message) {
    if constexpr (std::is_same_v<MessageType, visualization_msgs::Marker> ||
                  std::is_same_v<MessageType, visualization_msgs::MarkerArray>) {
      scene_.prepare(*message);  // drawing goes on meanwhile
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    scene_.add(layer, *message, timeInOrder());
  };
  const boost::function<void(const boost::shared_ptr<const MessageType>&)> function = callback;
  return nh_.subscribe<MessageType>(scene_.config().layers[layer].topic, queue, function);
}

void ProjectorNode::subscribeAll() {
  for (std::size_t i = 0; i < scene_.config().layers.size(); ++i) {
    switch (scene_.config().layers[i].type) {
      case LayerType::PointCloud2:
        subscribers_.push_back(subscribe<sensor_msgs::PointCloud2>(i, kCloudQueue));
        break;
      case LayerType::LaserScan:
        subscribers_.push_back(subscribe<sensor_msgs::LaserScan>(i, kCloudQueue));
        break;
      case LayerType::Path:
        subscribers_.push_back(subscribe<nav_msgs::Path>(i, kCloudQueue));
        break;
      case LayerType::Marker:
        subscribers_.push_back(subscribe<visualization_msgs::Marker>(i, kMarkerQueue));
        break;
      case LayerType::MarkerArray:
        subscribers_.push_back(subscribe<visualization_msgs::MarkerArray>(i, kMarkerQueue));
        break;
    }
  }
}

ros::Time ProjectorNode::timeInOrder() {
  const ros::Time now = ros::Time::now();
  // As RViz: what was shown belongs to another time. The listener clears the transforms itself.
  if (now + kJump < last_time_) {
    ROS_WARN("ROS time has jumped back: the projection is cleared");
    scene_.clear();
  }
  last_time_ = now;
  return now;
}

// ------------------------------------------------------------------------------------------
// drawing
void ProjectorNode::startDrawing() {
  std::promise<std::string> started;
  std::future<std::string> description = started.get_future();
  drawing_ = std::thread([this, started = std::move(started)]() mutable {
    try {
      render::GlContext context;
      render::ProjectorRenderer renderer(context, lens_, scene_.config().drawing);
      started.set_value(context.description() + "; " + renderer.description());
      drawLoop(renderer);
    } catch (...) {
      started.set_exception(std::current_exception());
    }
  });
  try {
    gl_description_ = description.get();
  } catch (...) {
    drawing_.join();
    throw;
  }
}

void ProjectorNode::drawLoop(render::ProjectorRenderer& renderer) {
  const auto period = std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(1 / options_.rate_hz));
  auto deadline = std::chrono::steady_clock::now();
  try {
    while (!is_stopping_) {
      drawOne(renderer);
      deadline += period;
      const auto now = std::chrono::steady_clock::now();
      if (deadline < now) {  // go on from here: no burst of pictures to catch up
        ++late_;
        deadline = now;
      }
      std::this_thread::sleep_until(deadline);
    }
  } catch (const std::exception& error) {
    const std::lock_guard<std::mutex> lock(mutex_);
    failure_ = error.what();
  }
}

void ProjectorNode::drawOne(render::ProjectorRenderer& renderer) {
  ros::Time now;
  const SceneFrame frame = composeFrame(now);
  render::Image image = std::move(used_picture_);
  if (frame.T_projector_world) {
    renderer.render(frame.scene, *frame.T_projector_world, image);
  } else {
    image = black();
  }
  ros::Time drawn_for = now;
  if (!now.isZero()) drawn_for += ros::Duration().fromNSec(scene_.config().latency_ns);
  publish(image, drawn_for);
  ++drawn_;
  {
    const std::lock_guard<std::mutex> lock(picture_mutex_);
    if (picture_) used_picture_ = std::move(*picture_);
    picture_ = std::move(image);
  }
  picture_ready_.notify_one();
}

SceneFrame ProjectorNode::composeFrame(ros::Time& now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  now = timeInOrder();
  SceneFrame frame;
  if (now.isZero()) {
    frame.problems = {"projector: waiting for /clock"};
  } else {
    frame = scene_.frame(now);
  }
  problems_ = frame.problems;
  return frame;
}

render::Image ProjectorNode::black() const {
  const auto pixels =
      static_cast<std::size_t>(lens_.width) * static_cast<std::size_t>(lens_.height);
  return {lens_.width, lens_.height, std::vector<std::uint8_t>(3 * pixels, 0)};
}

void ProjectorNode::publish(const render::Image& image, ros::Time drawn_for) {
  std_msgs::Header header;
  header.stamp = drawn_for;
  header.frame_id = scene_.config().frame;
  const auto info = boost::make_shared<sensor_msgs::CameraInfo>(toCameraInfo(lens_));
  info->header = header;
  camera_info_publisher_.publish(info);
  if (image_publisher_.getNumSubscribers() == 0) return;
  const auto message = boost::make_shared<sensor_msgs::Image>(toImage(image));
  message->header = header;
  image_publisher_.publish(message);
}

std::optional<render::Image> ProjectorNode::takePicture(std::chrono::milliseconds patience) {
  std::unique_lock<std::mutex> lock(picture_mutex_);
  picture_ready_.wait_for(lock, patience, [this] { return picture_.has_value(); });
  return std::exchange(picture_, std::nullopt);
}

std::string ProjectorNode::failure() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return failure_;
}

void ProjectorNode::stop() {
  is_stopping_ = true;
  if (drawing_.joinable()) drawing_.join();
  publish(black(), ros::Time::now());
}

// --------------------------------------------------------------------------------------
// diagnostics
void ProjectorNode::publishDiagnostics() {
  const auto now = std::chrono::steady_clock::now();
  const std::uint64_t drawn = drawn_;
  ProjectorState state;
  state.name = ros::this_node::getName().substr(1);
  state.renderer = gl_description_;
  state.wanted_hz = options_.rate_hz;
  state.drawn_hz = static_cast<double>(drawn - drawn_before_) /
                   std::chrono::duration<double>(now - counted_at_).count();
  state.late = late_;
  drawn_before_ = drawn;
  counted_at_ = now;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    state.problems = problems_;
    state.layers = scene_.status();
  }
  diagnostic_msgs::DiagnosticArray array = toDiagnostics(state);
  if (watch_) array.status.push_back(watch_->status(state.name));
  array.header.stamp = ros::Time::now();
  diagnostics_publisher_.publish(array);
}

}  // namespace afterglow::nodes
