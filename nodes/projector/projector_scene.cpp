#include "nodes/projector/projector_scene.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <stdexcept>
#include <utility>

#include "nodes/conversion/camera_messages.hpp"
#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/conversion/marker_conversion.hpp"
#include "nodes/projector/frame_lookup.hpp"
#include "nodes/projector/layer_state.hpp"

namespace afterglow::nodes {

bool isRead(const FutureMesh& mesh) {
  return mesh.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

bool UnreadMeshes::add(UnreadMesh unread) {
  remove(unread.layer, unread.key());
  if (waiting_.size() >= kMost) return false;
  waiting_.push_back(std::move(unread));
  return true;
}

void UnreadMeshes::remove(std::size_t layer, const ContentKey& key) {
  waiting_.remove_if(
      [&](const UnreadMesh& unread) { return unread.layer == layer && unread.key() == key; });
}

void UnreadMeshes::removeAll(std::size_t layer) {
  waiting_.remove_if([&](const UnreadMesh& unread) { return unread.layer == layer; });
}

std::vector<UnreadMesh> UnreadMeshes::takeRead() {
  std::vector<UnreadMesh> read;
  for (auto it = waiting_.begin(); it != waiting_.end();) {
    if (isRead(it->mesh)) {
      read.push_back(std::move(*it));
      it = waiting_.erase(it);
    } else {
      ++it;
    }
  }
  return read;
}

namespace {

constexpr std::size_t kCloudQueue = 10;  // RViz's
constexpr std::size_t kMostPolygons = 10'000;
/// A viewer lower than this over a surface, in meters, sees nothing on it.
constexpr double kLeastViewerHeight = 0.01;

std::int64_t toNs(ros::Time time) { return static_cast<std::int64_t>(time.toNSec()); }

ros::Time stampOf(std::int64_t ns) {
  ros::Time stamp;
  stamp.fromNSec(static_cast<std::uint64_t>(ns));
  return stamp;
}

LayerState makeLayer(const LayerConfig& config) {
  const bool several = config.type == LayerType::Marker || config.type == LayerType::MarkerArray ||
                       config.type == LayerType::PolygonArray;
  LayerState::Limits limits;
  if (!several) limits.waiting = kCloudQueue;
  return {config.topic, config.alpha, limits};
}

}  // namespace

ProjectorScene::ProjectorScene(ProjectorConfig config, const tf2::BufferCore& buffer,
                               MeshReading reading)
    : config_(std::move(config)),
      frames_(buffer, config_.fixed_frame),
      surfaces_(config_.surfaces),
      next_(config_.layers.size(), 0),
      memory_(config_.layers.size()),
      assets_(config_.mesh_roots),
      reading_(reading),
      offsets_(config_.projectors.size()) {
  for (const LayerConfig& layer : config_.layers) layers_.push_back(makeLayer(layer));
  if (config_.base) commanded_.emplace(*config_.base);
}

void ProjectorScene::show(LayerState& layer, const ContentKey& key, const std_msgs::Header& header,
                          Content content, ros::Time now) {
  content.frame = frameName(header.frame_id);
  content.stamp = header.stamp;
  layer.put(key, std::move(content), toNs(now), frames_);
}

// --------------------------------------------------------------------- messages other than markers
void ProjectorScene::addContent(std::size_t index, const std_msgs::Header& header,
                                Converted<Content> content, ros::Time now) {
  LayerState& layer = layers_[index];
  frames_.forget(toNs(now));
  layer.beginMessage();
  if (!content.value) return layer.drop(content.reason);
  if (!content.reason.empty()) layer.remark(content.reason);
  const bool is_empty = content.value->drawables.empty();
  const std::string fault = is_empty ? "" : headerFault(header);
  if (!fault.empty()) return layer.drop(fault);
  const ContentKey key = nextKey(index);
  if (is_empty) return layer.clear(key, content.value->nothing);
  show(layer, key, header, std::move(*content.value), now);
}

ContentKey ProjectorScene::nextKey(std::size_t index) {
  const LayerConfig& config = config_.layers[index];
  const int count = next_[index];
  next_[index] = count == std::numeric_limits<int>::max() ? 0 : count + 1;
  return {"", config.decay_ns > 0 ? count : count % config.buffer_length};
}

void ProjectorScene::add(std::size_t index, const jsk_recognition_msgs::PolygonArray& message,
                         ros::Time now) {
  LayerState& layer = layers_[index];
  frames_.forget(toNs(now));
  layer.beginMessage();
  const int count = static_cast<int>(std::min(message.polygons.size(), kMostPolygons));
  if (message.polygons.size() > kMostPolygons) layer.remark("more than 10000 polygons");
  for (int i = 0; i < count; ++i) {
    const geometry_msgs::PolygonStamped& polygon = message.polygons[static_cast<std::size_t>(i)];
    auto content = toContent(polygon, config_.layers[index]);
    const std::string fault = content.value ? headerFault(polygon.header) : content.reason;
    if (!fault.empty()) layer.drop(fault);
    if (!fault.empty() || content.value->drawables.empty()) {
      layer.remove({"", i});
    } else {
      show(layer, {"", i}, polygon.header, std::move(*content.value), now);
    }
  }
  for (int i = count; i < memory_[index].polygons; ++i) layer.remove({"", i});
  memory_[index].polygons = count;
  if (count == 0) layer.clear({"", 0}, "an array without polygons");
}

void ProjectorScene::add(std::size_t index, const nav_msgs::Odometry& message, ros::Time now) {
  const LayerConfig& config = config_.layers[index];
  auto content = toContent(message, config);
  std::optional<geometry_msgs::Pose>& last = memory_[index].odometry;
  const auto before = last ? toPose(*last).value : std::nullopt;
  const auto pose = toPose(message.pose.pose).value;
  const bool is_near =
      content.value && before && pose &&
      (pose->translation() - before->translation()).norm() < config.position_tolerance &&
      Eigen::AngleAxisd(before->linear().transpose() * pose->linear()).angle() <
          config.angle_tolerance;
  if (is_near) return layers_[index].beginMessage();
  if (content.value) last = message.pose.pose;
  addContent(index, message.header, std::move(content), now);
}

void ProjectorScene::add(std::size_t index, const nav_msgs::OccupancyGrid& message, ros::Time now) {
  auto content = toContent(message, config_.layers[index]);
  std_msgs::Header header = message.header;
  header.stamp = ros::Time();
  if (content.value) memory_[index].map = message;
  addContent(index, header, std::move(content), now);
}

void ProjectorScene::add(std::size_t index, const map_msgs::OccupancyGridUpdate& message,
                         ros::Time now) {
  nav_msgs::OccupancyGrid& map = memory_[index].map;
  if (map.data.empty()) return drop(index, "an update before its map");
  if (const std::string fault = updateMap(message, map); !fault.empty()) return drop(index, fault);
  std_msgs::Header header = map.header;
  header.stamp = ros::Time();
  addContent(index, header, toContent(map, config_.layers[index]), now);
}

void ProjectorScene::add(std::size_t index, const sensor_msgs::Image& message, ros::Time now) {
  const LayerConfig& config = config_.layers[index];
  Memory& memory = memory_[index];
  if (!config.camera_info.empty() && !memory.lens) {
    drop(index, "no message on " + config.camera_info + " yet");
    memory.image = message;
    return;
  }
  std_msgs::Header header = message.header;
  if (config.camera_info.empty() && config.surface) {
    header.frame_id = config_.surfaces[*config.surface].frame;
    header.stamp = ros::Time();
  }
  addContent(index, header, toContent(message, config, memory.lens), now);
}

void ProjectorScene::add(std::size_t index, const sensor_msgs::CameraInfo& message, ros::Time now) {
  Memory& memory = memory_[index];
  try {
    memory.lens = toLens(message);
  } catch (const std::invalid_argument& error) {
    return drop(index, error.what());
  }
  if (!memory.image) return;
  const sensor_msgs::Image image = std::move(*memory.image);
  memory.image.reset();
  add(index, image, now);
}

// ---------------------------------------------------------------------------------------- markers

void ProjectorScene::add(std::size_t layer, const visualization_msgs::Marker& message,
                         ros::Time now) {
  frames_.forget(toNs(now));
  layers_[layer].beginMessage();
  addMarker(layer, message, now);
}

void ProjectorScene::add(std::size_t layer, const visualization_msgs::MarkerArray& message,
                         ros::Time now) {
  frames_.forget(toNs(now));  // once: markers of one message share what is looked up
  layers_[layer].beginMessage();
  for (const visualization_msgs::Marker& marker : message.markers) {
    addMarker(layer, marker, now);
  }
}

void ProjectorScene::addMarker(std::size_t index, const visualization_msgs::Marker& marker,
                               ros::Time now) {
  using visualization_msgs::Marker;
  LayerState& layer = layers_[index];
  const ContentKey key{marker.ns, marker.id};
  // Deletes need no frame, and DELETEALL no namespace either.
  if (marker.action == Marker::DELETEALL) {
    unread_.removeAll(index);
    return layer.removeAll();
  }
  if (marker.action != Marker::ADD && marker.action != Marker::DELETE) {
    return layer.drop("unknown action");
  }
  unread_.remove(index, key);
  if (marker.action == Marker::DELETE) return layer.remove(key);

  const FutureMesh mesh = meshOf(marker);
  if (!mesh.valid()) return showMarker(layer, marker, now);
  if (isRead(mesh)) return showMarker(layer, marker, now, &mesh.get());
  layer.remove(key);
  if (!unread_.add({index, marker, now, mesh})) {
    layer.drop("more than 1000 markers wait for their meshes");
  }
}

FutureMesh ProjectorScene::meshOf(const visualization_msgs::Marker& marker) {
  const bool is_beside = reading_ == MeshReading::BesideDrawing;
  if (!is_beside || marker.type != visualization_msgs::Marker::MESH_RESOURCE) return {};
  return assets_.meshes().ask(marker.mesh_resource);
}

void ProjectorScene::showMarker(LayerState& layer, const visualization_msgs::Marker& marker,
                                ros::Time arrived, const MeshLibrary::Mesh* mesh) {
  const ContentKey key{marker.ns, marker.id};
  auto drawable = toDrawable(marker, assets_, mesh);
  const std::string fault = drawable.value ? headerFault(marker.header) : drawable.reason;
  if (!fault.empty()) {
    layer.remove(key);  // as RViz: the marker that it replaces is no longer true
    return layer.drop(fault);
  }
  if (!drawable.reason.empty()) layer.remark(drawable.reason);
  Content content;
  content.drawables.push_back(std::move(*drawable.value));
  content.frame_locked = marker.frame_locked != 0;
  content.lifetime_ns =
      std::int64_t{marker.lifetime.sec} * 1'000'000'000 + std::int64_t{marker.lifetime.nsec};
  show(layer, key, marker.header, std::move(content), arrived);
}

void ProjectorScene::drop(std::size_t layer, const std::string& reason) {
  layers_[layer].beginMessage();
  layers_[layer].drop(reason);
}

void ProjectorScene::addCommand(const geometry_msgs::Twist& command, ros::Time now) {
  if (commanded_) commanded_->add(command, toNs(now));
}

// ----------------------------------------------------------------------------------------- frames

void ProjectorScene::update(ros::Time now) {
  frames_.forget(toNs(now));
  for (const UnreadMesh& unread : unread_.takeRead()) {
    showMarker(layers_[unread.layer], unread.marker, unread.arrived, &unread.mesh.get());
  }
  for (LayerState& layer : layers_) layer.update(toNs(now), frames_);
}

void ProjectorScene::clear() {
  unread_.clear();
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    if (config_.layers[i].type == LayerType::OccupancyGrid) continue;
    layers_[i].removeAll();
    memory_[i] = {};
  }
  offsets_.assign(offsets_.size(), {});
  if (commanded_) commanded_->clear();
}

void ProjectorScene::takeSurface(std::size_t surface, const Finding& finding) {
  surfaces_.take(surface, finding);
}

SceneSnapshot ProjectorScene::snapshot(ros::Time now) {
  SceneSnapshot snapshot;
  std::vector<std::string> problems;
  snapshot.scene = scene(now, problems);
  if (!config_.projectors.empty()) {
    snapshot.T_projector_world = projectorPose(0, now, 0, snapshot.problems);
  }
  for (std::size_t i = 1; i < config_.projectors.size(); ++i) {
    std::vector<std::string> of_another;
    snapshot.T_others_world.push_back(projectorPose(i, now, 0, of_another));
  }
  snapshot.problems.insert(snapshot.problems.end(), problems.begin(), problems.end());
  return snapshot;
}

render::Scene ProjectorScene::scene(ros::Time now, std::vector<std::string>& problems) {
  update(now);
  surfaces_.update(frames_, problems);
  render::Scene scene;
  scene.surfaces = surfaces_.known();
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    if (auto drawn = layer(i, problems)) scene.layers.push_back(std::move(*drawn));
    const std::string& missing = layers_[i].explain(frames_);
    if (!missing.empty()) problems.push_back(config_.layers[i].topic + ": " + missing);
  }
  if (!unread_.waiting().empty()) {
    const std::string& resource = unread_.waiting().front().marker.mesh_resource;
    problems.push_back("mesh '" + printable(resource) + "' is being read");
  }
  return scene;
}

bool ProjectorScene::isWaiting() const {
  return !unread_.waiting().empty() ||
         std::any_of(layers_.begin(), layers_.end(),
                     [](const LayerState& layer) { return layer.isWaiting(); });
}

std::optional<render::Layer> ProjectorScene::layer(std::size_t index,
                                                   std::vector<std::string>& problems) {
  const LayerConfig& config = config_.layers[index];
  render::Layer layer;
  layer.name = config.topic;
  layer.placement = config.placement;
  if (config.surface) {
    layer.surface = surfaces_[*config.surface];
    layer.gain = config_.surfaces[*config.surface].gain;
    if (!layer.surface) return std::nullopt;
  }
  if (config.viewer) {
    const auto pose = frames_.at(config.viewer->frame, ros::Time(0));
    if (!pose) {
      problems.push_back(frames_.noTransform("viewer", config.viewer->frame));
      return std::nullopt;
    }
    layer.p_viewer = *pose * config.viewer->p_frame;
    const Eigen::Vector3d p_surface = layer.surface->T_world_surface.inverse() * layer.p_viewer;
    if (!(p_surface.z() > kLeastViewerHeight)) {
      problems.push_back("viewer: not above surface '" + layer.surface->name + "'");
      return std::nullopt;
    }
  }
  if (config.reader) {
    const auto pose = frames_.at(config.reader->frame, ros::Time(0));
    if (!pose) {
      problems.push_back(frames_.noTransform("reader", config.reader->frame));
      return std::nullopt;
    }
    const bool is_direction = config.reader->is_direction;
    const Eigen::Vector3d& p_frame = config.reader->p_frame;
    layer.reader = render::Reader{
        is_direction ? Eigen::Vector3d(pose->linear() * p_frame) : Eigen::Vector3d(*pose * p_frame),
        is_direction};
  }
  layer.drawables = layers_[index].drawables(frames_);
  return layer;
}

std::optional<Rigid<Projector, World>> ProjectorScene::projectorPose(
    std::size_t projector, ros::Time now, std::int64_t drawing_ns,
    std::vector<std::string>& problems) {
  const OutputConfig& config = config_.projectors[projector];
  const auto newest = frames_.newest(config.frame);
  if (!newest || frames_.isStale(*newest)) {
    problems.push_back(frames_.noTransform("projector", config.frame));
    return std::nullopt;
  }
  if (config.latency_ns == 0) return Rigid<World, Projector>(newest->T_fixed_frame).inverse();
  const std::int64_t light_ns = toNs(now) + config.aheadNs(drawing_ns);
  const auto T_fixed_projector =
      frames_.predicted(config.frame, *newest, light_ns, frames_.smoothFrame(config.frame));
  if (!T_fixed_projector) {
    problems.push_back("projector: it moves, and the transform from '" + config.frame + "' to '" +
                       config_.fixed_frame + "' is too old to say where to");
    return std::nullopt;
  }
  return Rigid<World, Projector>(*T_fixed_projector *
                                 commandedDeparture(config.frame, *newest, light_ns))
      .inverse();
}

Eigen::Isometry3d ProjectorScene::commandedDeparture(const std::string& frame,
                                                     const StampedPose& newest,
                                                     std::int64_t when_ns) {
  const Eigen::Isometry3d none = Eigen::Isometry3d::Identity();
  if (!commanded_ || newest.stamp_ns <= kVelocityBaseNs) return none;
  if (!frames_.isCarried(frame, commanded_->config().frame)) return none;
  const auto T_fixed_base = frames_.at(commanded_->config().frame, stampOf(newest.stamp_ns));
  if (!T_fixed_base) return none;
  const Eigen::Isometry3d T_frame_base = newest.T_fixed_frame.inverse() * *T_fixed_base;
  return T_frame_base *
         commanded_->departure(newest.stamp_ns - kVelocityBaseNs, newest.stamp_ns, when_ns) *
         T_frame_base.inverse();
}

void ProjectorScene::noteLight(std::size_t projector, ros::Time shown,
                               const Rigid<Projector, World>& T_projector_world) {
  const OutputConfig& config = config_.projectors[projector];
  offsets_[projector].add(T_projector_world, toNs(shown) + config.latency_ns);
  offsets_[projector].compare(frames_, config.frame);
}

std::vector<LayerStatus> ProjectorScene::status() const {
  std::vector<LayerStatus> all;
  for (const LayerState& layer : layers_) all.push_back(layer.status());
  return all;
}

}  // namespace afterglow::nodes
