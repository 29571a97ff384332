#include "nodes/projector/projector_node.hpp"

#include <fmt/format.h>
#include <sensor_msgs/LaserScan.h>
#include <sensor_msgs/PointCloud2.h>
#include <visualization_msgs/Marker.h>
#include <visualization_msgs/MarkerArray.h>

#include <exception>
#include <optional>
#include <stdexcept>
#include <utility>

#include "nodes/conversion/beam_markers.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::uint32_t kCloudQueue = 10, kMarkerQueue = 100;  // RViz's

/// Returns the length of a queue: where the next message replaces the last one, only the newest is
/// worth the wait.
std::uint32_t queueOf(const LayerConfig& layer) {
  const bool is_added =
      layer.type == LayerType::OccupancyGrid;  // updates do not replace each other
  if (is_added) return kCloudQueue;
  if (layer.type == LayerType::Marker || layer.type == LayerType::MarkerArray) return kMarkerQueue;
  return layer.decay_ns > 0 || layer.buffer_length > 1 ? kCloudQueue : 1;
}

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

std::string blendingWords(const render::LightBlend::Summary& summary) {
  std::string words = fmt::format("{:.0f} % of its picture is shared", 100 * summary.shared);
  if (summary.dimmed < 1) {
    words +=
        fmt::format(", evened: dimmed to {:.0f} % where it is brightest", 100 * summary.dimmed);
  }
  if (summary.raised > 0) {
    words += fmt::format(", black raised to {:.2f} % of its light", 100 * summary.raised);
  }
  return words;
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
  own.param("beam_length", options.beam_m, options.beam_m);
  if (!(options.beam_m >= 0 && options.beam_m <= 100)) {
    throw std::runtime_error("parameter ~beam_length should be from 0 to 100 m");
  }
  options.window = WindowChoice::read(own);
  return options;
}

ProjectorNode::ProjectorNode(const ProjectorNodeOptions& options)
    : options_(options),
      scene_(loadConfig(options), transforms_, ProjectorScene::MeshReading::BesideDrawing),
      schedule_(options.rate_hz),
      diagnostics_(options.rate_hz) {
  const std::optional<BlendConfig>& blend = scene_.config().blend;
  std::vector<render::BlendedProjector> blended;
  for (const OutputConfig& projector : scene_.config().projectors) {
    outputs_.push_back(
        std::make_unique<ProjectorOutput>(projector, own_, options.beam_m, blend.has_value()));
    blended.push_back(projector.blended(outputs_.back()->lens()));
  }
  if (blend) blend_ = std::make_unique<render::LightBlend>(blended, blend->evens_black);
  problems_.resize(outputs_.size());
  subscribeAll();
  subscribeAvoided();
  if (scene_.config().watch) {
    watch_ = std::make_unique<DriftMonitor>(*scene_.config().watch, transforms_);
  }
  surface_service_ = std::make_unique<SurfaceService>(
      scene_.config().surfaces, transforms_, [this](std::size_t surface, const Finding& finding) {
        const std::lock_guard<std::mutex> lock(mutex_);
        scene_.takeSurface(surface, finding);
      });
  surfaces_publisher_ = own_.advertise<visualization_msgs::MarkerArray>("surfaces", 1, true);
  std::vector<std::string> topics;
  for (const auto* all : {&subscribers_, &avoided_subscribers_}) {
    for (const ros::Subscriber& subscriber : *all) topics.push_back(subscriber.getTopic());
  }
  topic_watch_ = std::make_unique<TopicMonitor>(std::move(topics));
  startDrawing();
  diagnostics_timer_ =
      own_.createWallTimer(ros::WallDuration(1), [this](const ros::WallTimerEvent&) {
        readRobot();
        publishDiagnostics();
      });
}

ProjectorNode::~ProjectorNode() { endDrawing(); }

// ------------------------------------------------------------------------------------------ input

template <typename MessageType>
void ProjectorNode::timeArrival(const MessageType& message) {
  const ros::Time* stamp = ros::message_traits::timeStamp(message);
  const ros::Time now = ros::Time::now();
  if (stamp == nullptr || stamp->isZero() || *stamp > now) return;
  times_.add(Stage::Arrived, std::chrono::nanoseconds((now - *stamp).toNSec()));
}

template <typename MessageType, typename Take>
ros::Subscriber ProjectorNode::subscribe(const std::string& topic, std::uint32_t queue,
                                         const Take& take) {
  const auto callback = [this, take](const boost::shared_ptr<const MessageType>& message) {
    timeArrival(*message);
    Lap lap;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      times_.add(Stage::Locked, lap.next());
      take(*message, timeInOrder());
    }
    times_.add(Stage::Converted, lap.next());
    schedule_.announce();
  };
  const boost::function<void(const boost::shared_ptr<const MessageType>&)> function = callback;
  return own_.subscribe<MessageType>(topic, queue, function, ros::VoidConstPtr(),
                                     ros::TransportHints().tcpNoDelay());
}

template <typename MessageType>
ros::Subscriber ProjectorNode::subscribeLayer(std::size_t layer, const std::string& topic) {
  const auto take = [this, layer](const MessageType& message, ros::Time now) {
    scene_.add(layer, message, now);
  };
  return subscribe<MessageType>(topic, queueOf(scene_.config().layers[layer]), take);
}

template <typename MessageType>
ros::Subscriber ProjectorNode::subscribeAvoided(std::size_t source, const std::string& topic) {
  const auto take = [this, source](const MessageType& message, ros::Time now) {
    avoidance_->add(source, message, now);
  };
  return subscribe<MessageType>(topic, 1, take);
}

void ProjectorNode::subscribeAll() {
  const std::vector<LayerConfig>& layers = scene_.config().layers;
  for (std::size_t i = 0; i < layers.size(); ++i) {
    withMessageType(layers[i].type, [&](auto tag) {
      subscribers_.push_back(subscribeLayer<typename decltype(tag)::Type>(i, layers[i].topic));
    });
  }
  if (const std::optional<BaseConfig>& base = scene_.config().base) {
    const boost::function<void(const geometry_msgs::Twist::ConstPtr&)> take =
        [this](const geometry_msgs::Twist::ConstPtr& command) {
          const std::lock_guard<std::mutex> lock(mutex_);
          scene_.addCommand(*command, timeInOrder());
        };
    command_subscriber_ = own_.subscribe<geometry_msgs::Twist>(base->command_topic, kMarkerQueue,
                                                               take, ros::VoidConstPtr(),
                                                               ros::TransportHints().tcpNoDelay());
  }
  // Behind all of the first: subscribers_[i] is of layer i.
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const std::string topic = layers[i].secondTopic();
    if (topic.empty()) continue;
    withSecondType(layers[i].type, [&](auto tag) {
      subscribers_.push_back(subscribeLayer<typename decltype(tag)::Type>(i, topic));
    });
  }
}

void ProjectorNode::subscribeAvoided() {
  const ProjectorConfig& config = scene_.config();
  if (!config.avoid) return;
  avoidance_.emplace(*config.avoid, transforms_, config.fixed_frame);
  for (std::size_t i = 0; i < config.avoid->sources.size(); ++i) {
    const LayerConfig& source = config.avoid->sources[i].layer;
    avoided_subscribers_.push_back(
        source.type == LayerType::LaserScan
            ? subscribeAvoided<sensor_msgs::LaserScan>(i, source.topic)
            : subscribeAvoided<sensor_msgs::PointCloud2>(i, source.topic));
  }
  if (!config.avoid->robot) return;
  robot_reader_ = std::make_unique<RobotSurfaceReader>(config.avoid->robot->description,
                                                       config.mesh_roots, transforms_);
}

void ProjectorNode::readRobot() {
  if (!robot_reader_) return;
  auto robot = robot_reader_->read();
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!robot) return avoidance_->refuseRobot(robot_reader_->reason());
  avoidance_->setRobot(std::move(*robot));
  robot_reader_.reset();
}

ros::Time ProjectorNode::timeInOrder() {
  const ros::Time now = ros::Time::now();
  // As RViz: what was shown belongs to another time. The listener clears the transforms itself.
  if (now.toNSec() + kJumpNs < last_time_.toNSec()) {
    ROS_WARN("ROS time has jumped back: the projection is cleared");
    scene_.clear();
    if (avoidance_) avoidance_->clear();
  }
  last_time_ = now;
  return now;
}

// ---------------------------------------------------------------------------------------- drawing

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
  while (!schedule_.isStopped()) {
    const auto drawn_at = std::chrono::steady_clock::now();
    drawAll();
    diagnostics_.countImage(std::chrono::steady_clock::now() - drawn_at);
    const auto waited = schedule_.awaitDue(drawn_at, isWaiting());
    if (waited) times_.add(Stage::Scheduled, *waited);
  }
}

bool ProjectorNode::isWaiting() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return scene_.isWaiting() || (avoidance_ && avoidance_->isWaiting());
}

void ProjectorNode::drawAll() {
  render::Scene scene;
  std::vector<std::optional<Rigid<Projector, World>>> poses(outputs_.size());
  std::vector<std::optional<std::vector<render::AvoidedPoints>>> avoided(outputs_.size());
  std::vector<std::vector<std::string>> problems(outputs_.size());
  ros::Time now;
  Lap lap;
  const std::int64_t drawing_ns = std::chrono::nanoseconds(schedule_.usual()).count();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    now = timeInOrder();
    std::vector<std::string> of_scene;
    if (!now.isZero()) scene = scene_.scene(now, of_scene);
    if (!now.isZero() && avoidance_) avoidance_->update(now, scene.surfaces);
    for (std::size_t i = 0; i < outputs_.size(); ++i) {
      if (now.isZero()) {
        problems[i].push_back("projector: waiting for /clock");
      } else {
        poses[i] = scene_.projectorPose(i, now, drawing_ns, problems[i]);
      }
      if (poses[i] && avoidance_) {
        const OutputConfig& config = outputs_[i]->config();
        const auto light_ns = static_cast<std::int64_t>(now.toNSec()) + config.aheadNs(drawing_ns);
        avoided[i] = avoidance_->points(config.frame, *poses[i], light_ns, problems[i]);
        if (!avoided[i]) poses[i].reset();
      }
      problems[i].insert(problems[i].end(), of_scene.begin(), of_scene.end());
    }
    problems_ = std::move(problems);
  }
  times_.add(Stage::Composed, lap.next());
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    outputs_[i]->beginDrawing(scene, poses[i], avoided[i] ? &*avoided[i] : nullptr);
  }
  std::vector<std::string> blending = blend(scene, poses);
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    outputs_[i]->finishDrawing(now, drawing_ns, blend_ ? &blend_->light(i) : nullptr, times_);
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    has_pictures_ = true;
    blending_ = std::move(blending);
    for (std::size_t i = 0; i < outputs_.size(); ++i) {
      if (poses[i]) scene_.noteLight(i, ros::Time::now(), *poses[i]);
    }
  }
  pictures_ready_.notify_one();
  for (std::size_t i = 0; i < outputs_.size(); ++i) outputs_[i]->takeCensus(scene, poses[i]);
}

std::vector<std::string> ProjectorNode::blend(
    const render::Scene& scene, std::vector<std::optional<Rigid<Projector, World>>> poses) {
  std::vector<std::string> words(outputs_.size());
  if (!blend_) return words;
  Lap lap;
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    if (!outputs_[i]->windowProblem().empty()) poses[i].reset();
  }
  blend_->update(scene.surfaces, poses);
  times_.add(Stage::Blended, lap.next());
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    words[i] = poses[i] ? blendingWords(blend_->summary(i)) : "dark: others give its light";
  }
  return words;
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
  schedule_.stop();
  if (drawing_.joinable()) drawing_.join();
}

void ProjectorNode::stop() {
  endDrawing();
  for (const auto& output : outputs_) output->publishBlack();
}

// ------------------------------------------------------------------------------------ diagnostics

void ProjectorNode::addSources(std::vector<LayerStatus>& layers) const {
  const TopicSources sources = topic_watch_->sources();
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const auto found = sources.find(subscribers_[i].getTopic());
    if (found == sources.end()) continue;
    layers[i].type = typeName(scene_.config().layers[i].type);
    layers[i].source = found->second;
  }
}

std::vector<LayerStatus> ProjectorNode::avoidedSources() const {
  if (!avoidance_) return {};
  std::vector<LayerStatus> all = avoidance_->status();
  const TopicSources sources = topic_watch_->sources();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto found = sources.find(avoided_subscribers_[i].getTopic());
    all[i].topic = "avoid " + all[i].topic;
    if (found == sources.end()) continue;
    all[i].type = typeName(avoidance_->config().sources[i].layer.type);
    all[i].source = found->second;
  }
  return all;
}

void ProjectorNode::publishDiagnostics() {
  ProjectorState state;
  std::vector<LayerStatus> of_avoided;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    state.layers = scene_.status();
    of_avoided = avoidedSources();
    surfaces_publisher_.publish(
        surfaceMarkers(scene_.surfaces(), scene_.config().fixed_frame));
    for (std::size_t i = 0; i < outputs_.size(); ++i) {
      state.outputs.push_back({outputs_[i]->config().name,
                               outputs_[i]->renderer(),
                               problems_[i],
                               {},
                               scene_.lightOffset(i).mm(),
                               outputs_[i]->avoidedShare(),
                               i < blending_.size() ? blending_[i] : "",
                               outputs_[i]->textures()});
    }
  }
  state.stages = times_.words();
  addSources(state.layers);
  state.layers.insert(state.layers.end(), of_avoided.begin(), of_avoided.end());
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    std::vector<std::string>& problems = state.outputs[i].problems;
    const std::string window_problem = outputs_[i]->windowProblem();
    if (!window_problem.empty()) problems.insert(problems.begin(), "projector: " + window_problem);
    for (const std::string& conflict : listener_.conflicts()) problems.push_back(conflict);
    state.outputs[i].census = outputs_[i]->census();
  }
  const LayerStatus transforms = listener_.status();
  if (!transforms.dropped.empty() || !transforms.remarks.empty()) {
    state.layers.push_back(transforms);
  }
  diagnostics_.publish(std::move(state),
                       watch_ ? std::optional(watch_->status(ros::this_node::getName().substr(1)))
                              : std::nullopt);
}

}  // namespace afterglow::nodes
