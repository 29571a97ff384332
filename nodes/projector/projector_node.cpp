#include "nodes/projector/projector_node.hpp"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <nav_msgs/Path.h>
#include <sensor_msgs/LaserScan.h>
#include <sensor_msgs/PointCloud2.h>
#include <visualization_msgs/Marker.h>
#include <visualization_msgs/MarkerArray.h>

#include <exception>
#include <optional>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "nodes/projector/projector_messages.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::uint32_t kCloudQueue = 10, kMarkerQueue = 100;  // RViz's

/// Where the next message replaces the last one, only the newest is worth the wait.
std::uint32_t queueOf(const LayerConfig& layer) {
  if (layer.type == LayerType::Marker || layer.type == LayerType::MarkerArray) return kMarkerQueue;
  return layer.decay_ns > 0 || layer.buffer_length > 1 ? kCloudQueue : 1;
}

const std::string kOwnProblem = "projector: ";  // not one of the whole scene's
constexpr std::uint64_t kJumpNs = 500'000'000;  // less is a clock being set right

/// ~monitor is for the only projector.
void setMonitor(ProjectorConfig& config, const std::string& monitor) {
  if (monitor.empty()) return;
  if (config.projectors.size() > 1) {
    throw std::runtime_error(
        "parameter ~monitor is for one projector; the configuration has several, each with its own "
        "'monitor'");
  }
  config.projectors.front().monitor = monitor;
}

ProjectorConfig loadConfig(const ProjectorNodeOptions& options) {
  ProjectorConfig config = loadProjectorConfig(options.config, options.calibration);
  setMonitor(config, options.window.monitor);
  return config;
}

/// Ends the renderers before the context they draw in.
struct RendererEnd {
  const std::vector<std::unique_ptr<ProjectorOutput>>& outputs;
  ~RendererEnd() {
    for (const auto& output : outputs) output->stopDrawing();
  }
};

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
    : options_(options), scene_(loadConfig(options), transforms_) {
  for (const OutputConfig& projector : scene_.config().projectors) {
    outputs_.push_back(std::make_unique<ProjectorOutput>(projector, own_));
  }
  problems_.resize(outputs_.size());
  diagnostics_publisher_ = nh_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 2);
  counted_at_ = std::chrono::steady_clock::now();
  subscribeAll();
  if (scene_.config().watch) {
    watch_ = std::make_unique<DriftWatch>(*scene_.config().watch, transforms_);
  }
  surface_service_ = std::make_unique<SurfaceService>(
      scene_.config().surfaces, transforms_, [this](std::size_t surface, const Finding& finding) {
        const std::lock_guard<std::mutex> lock(mutex_);
        scene_.takeSurface(surface, finding);
      });
  startDrawing();
  diagnostics_timer_ = nh_.createWallTimer(
      ros::WallDuration(1), [this](const ros::WallTimerEvent&) { publishDiagnostics(); });
}

ProjectorNode::~ProjectorNode() { endDrawing(); }

// --------------------------------------------------------------------------------------------
// input
template <typename MessageType>
ros::Subscriber ProjectorNode::subscribe(std::size_t layer) {
  const auto callback = [this, layer](const boost::shared_ptr<const MessageType>& message) {
    if constexpr (std::is_same_v<MessageType, visualization_msgs::Marker> ||
                  std::is_same_v<MessageType, visualization_msgs::MarkerArray>) {
      scene_.prepare(*message);  // drawing goes on meanwhile
    }
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      scene_.add(layer, *message, timeInOrder());
      has_news_ = true;
    }
    woken_.notify_all();
  };
  const boost::function<void(const boost::shared_ptr<const MessageType>&)> function = callback;
  const LayerConfig& config = scene_.config().layers[layer];
  return nh_.subscribe<MessageType>(config.topic, queueOf(config), function, ros::VoidConstPtr(),
                                    ros::TransportHints().tcpNoDelay());
}

void ProjectorNode::subscribeAll() {
  for (std::size_t i = 0; i < scene_.config().layers.size(); ++i) {
    switch (scene_.config().layers[i].type) {
      case LayerType::PointCloud2:
        subscribers_.push_back(subscribe<sensor_msgs::PointCloud2>(i));
        break;
      case LayerType::LaserScan:
        subscribers_.push_back(subscribe<sensor_msgs::LaserScan>(i));
        break;
      case LayerType::Path:
        subscribers_.push_back(subscribe<nav_msgs::Path>(i));
        break;
      case LayerType::Marker:
        subscribers_.push_back(subscribe<visualization_msgs::Marker>(i));
        break;
      case LayerType::MarkerArray:
        subscribers_.push_back(subscribe<visualization_msgs::MarkerArray>(i));
        break;
    }
  }
}

ros::Time ProjectorNode::timeInOrder() {
  const ros::Time now = ros::Time::now();
  // As RViz: what was shown belongs to another time. The listener clears the transforms itself.
  if (now.toNSec() + kJumpNs < last_time_.toNSec()) {
    ROS_WARN("ROS time has jumped back: the projection is cleared");
    scene_.clear();
  }
  last_time_ = now;
  return now;
}

// ------------------------------------------------------------------------------------------
// drawing
void ProjectorNode::startDrawing() {
  std::promise<void> started;
  std::future<void> start = started.get_future();
  drawing_ = std::thread([this, started = std::move(started)]() mutable { drawInThread(started); });
  try {
    start.get();
  } catch (...) {
    drawing_.join();
    throw;
  }
}

void ProjectorNode::drawInThread(std::promise<void>& started) {
  bool is_started = false;
  try {
    render::GlContext context;
    const RendererEnd end{outputs_};
    for (const auto& output : outputs_) output->startDrawing(context);
    is_started = true;
    started.set_value();
    drawLoop();
  } catch (const std::exception& error) {
    if (!is_started) return started.set_exception(std::current_exception());
    const std::lock_guard<std::mutex> lock(mutex_);
    failure_ = error.what();
  }
}

void ProjectorNode::drawLoop() {
  const std::chrono::duration<double> period(1 / options_.rate_hz);
  while (!is_stopping_) {
    const auto drawn_at = std::chrono::steady_clock::now();
    drawAll();
    if (std::chrono::steady_clock::now() - drawn_at > period) ++late_;
    awaitDue(drawn_at);
  }
}

void ProjectorNode::awaitDue(std::chrono::steady_clock::time_point drawn_at) {
  const auto period = std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(1 / options_.rate_hz));
  std::unique_lock<std::mutex> lock(mutex_);
  // What waits for a transform may be waiting for one that has just come. After news, the next may
  // come at about the same rate: a regular picture just before it would only delay it.
  const bool was_news = news_drawn_at_ + period / 2 > drawn_at;
  const auto regular = drawn_at + (scene_.isWaiting() ? period / 2
                                   : was_news         ? period + period / 4
                                                      : period);
  woken_.wait_until(lock, regular, [this] { return is_stopping_ || has_news_; });
  if (has_news_) {
    woken_.wait_until(lock, news_drawn_at_ + period / 2, [this] { return is_stopping_.load(); });
    news_drawn_at_ = std::chrono::steady_clock::now();
  }
  has_news_ = false;
}

void ProjectorNode::drawAll() {
  render::Scene scene;
  std::vector<std::optional<Rigid<Projector, World>>> poses(outputs_.size());
  std::vector<std::vector<std::string>> problems(outputs_.size());
  ros::Time now;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    now = timeInOrder();
    std::vector<std::string> of_scene;
    if (!now.isZero()) scene = scene_.scene(now, of_scene);
    for (std::size_t i = 0; i < outputs_.size(); ++i) {
      if (now.isZero()) {
        problems[i].push_back("projector: waiting for /clock");
      } else {
        poses[i] = scene_.projectorPose(i, now, problems[i]);
      }
      problems[i].insert(problems[i].end(), of_scene.begin(), of_scene.end());
    }
    problems_ = std::move(problems);
  }
  for (std::size_t i = 0; i < outputs_.size(); ++i) outputs_[i]->draw(scene, poses[i], now);
  ++drawn_;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    has_pictures_ = true;
  }
  pictures_ready_.notify_one();
}

void ProjectorNode::awaitPictures(std::chrono::milliseconds patience) {
  std::unique_lock<std::mutex> lock(mutex_);
  pictures_ready_.wait_for(lock, patience, [this] { return has_pictures_; });
  has_pictures_ = false;
}

std::string ProjectorNode::failure() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return failure_;
}

void ProjectorNode::endDrawing() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_stopping_ = true;
  }
  woken_.notify_all();
  if (drawing_.joinable()) drawing_.join();
}

void ProjectorNode::stop() {
  endDrawing();
  for (const auto& output : outputs_) output->publishBlack();
}

// --------------------------------------------------------------------------------------
// diagnostics
void ProjectorNode::publishDiagnostics() {
  const auto now = std::chrono::steady_clock::now();
  const std::uint64_t drawn = drawn_;
  ProjectorState state;
  state.name = ros::this_node::getName().substr(1);
  state.wanted_hz = options_.rate_hz;
  state.drawn_hz = static_cast<double>(drawn - drawn_before_) /
                   std::chrono::duration<double>(now - counted_at_).count();
  state.late = late_;
  drawn_before_ = drawn;
  counted_at_ = now;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    state.layers = scene_.status();
    for (std::size_t i = 0; i < outputs_.size(); ++i) {
      state.outputs.push_back({outputs_[i]->config().name, outputs_[i]->renderer(), problems_[i]});
    }
  }
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    std::vector<std::string>& problems = state.outputs[i].problems;
    const std::string window_problem = outputs_[i]->windowProblem();
    if (!window_problem.empty()) problems.insert(problems.begin(), kOwnProblem + window_problem);
  }
  const LayerStatus transforms = inbox_.status();
  if (!transforms.dropped.empty() || !transforms.remarks.empty())
    state.layers.push_back(transforms);
  logFaults(state);
  diagnostic_msgs::DiagnosticArray array = toDiagnostics(state);
  if (watch_) array.status.push_back(watch_->status(state.name));
  array.header.stamp = ros::Time::now();
  diagnostics_publisher_.publish(array);
}

void ProjectorNode::logFaults(const ProjectorState& state) {
  std::vector<std::string> problems;
  for (const auto& [name, renderer, of_picture] : state.outputs) {
    for (const std::string& problem : of_picture) {
      const bool is_own = !name.empty() && problem.rfind(kOwnProblem, 0) == 0;
      problems.push_back(is_own ? "projector " + name + ": " + problem.substr(kOwnProblem.size())
                                : problem);
    }
  }
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  const std::int64_t now_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
  for (const std::string& line : faults_.news(problems, state.layers, now_ns)) {
    ROS_WARN("%s", line.c_str());
  }
}

}  // namespace afterglow::nodes
