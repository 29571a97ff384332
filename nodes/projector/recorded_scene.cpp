#include "nodes/projector/recorded_scene.hpp"

#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/conversion/typed_message.hpp"
#include "nodes/projector/dark_reasons.hpp"
#include "nodes/projector/transform_listener.hpp"

namespace afterglow::nodes {
namespace {

using replay::kTransforms;

const char kStaticTransforms[] = "/tf_static";
constexpr std::int64_t kWaitingPeriod = 40'000'000;         // ns; that of a film
/// ns; a cloud without a transform after this time is given up for the next one.
constexpr std::int64_t kCloudPatience = 1'000'000'000;

}  // namespace

replay::Stamp endOf(const replay::Store& store, const replay::Behavior& behavior) {
  if (behavior.end) return *behavior.end;
  replay::Stamp last = behavior.begin;
  for (const auto& summary : store.topics(behavior)) last = std::max(last, summary.last);
  for (const auto& summary : store.contextTopics(behavior)) last = std::max(last, summary.last);
  return {last.ns + 1};
}

RecordedScene::RecordedScene(const replay::Store& store, replay::Behavior behavior,
                             const ProjectorConfig& config)
    : store_(store), behavior_(std::move(behavior)), scene_(config, transforms_) {
  replay::MessageRange range;
  range.topics = {kTransforms, kStaticTransforms};
  for (std::size_t i = 0; i < config.layers.size(); ++i) {
    for (const std::string& topic : {config.layers[i].topic, config.layers[i].secondTopic()}) {
      if (topic.empty()) continue;
      if (layers_.count(topic) == 0) range.topics.push_back(topic);
      layers_.emplace(topic, i);
    }
  }
  if (config.base) range.topics.push_back(config.base->command_topic);
  feedEarlierTransforms();
  findSurfaces();
  cursor_ = store_.messages(behavior_, range);
  next_ = cursor_->next();
}

void RecordedScene::feedEarlierTransforms() {
  const auto feedBetween = [this](const char* topic, std::int64_t begin_ns) {
    replay::Behavior before = behavior_;
    before.begin = {std::max<std::int64_t>(0, begin_ns)};
    before.end = behavior_.begin;
    const auto cursor = store_.messages(before, {{topic}, std::nullopt, std::nullopt});
    while (const auto message = cursor->next()) feed(*message);
  };
  feedBetween(kStaticTransforms, 0);
  feedBetween(kTransforms, behavior_.begin.ns - replay::kTransformsBefore_ns);
}

/// Finds surfaces in the first clouds of the recording whose transforms are known, as if before it
/// began.
void RecordedScene::findSurfaces() {
  const std::vector<SurfaceConfig>& surfaces = scene_.config().surfaces;
  SurfaceFinder finder(surfaces, transforms_);
  if (finder.topics().empty()) return;
  replay::MessageRange range;
  range.topics = finder.topics();
  range.topics.insert(range.topics.end(), {kTransforms, kStaticTransforms});
  std::map<std::string, sensor_msgs::PointCloud2> clouds;
  std::map<std::string, std::int64_t> next_ns;
  const auto cursor = store_.messages(behavior_, range);
  while (!finder.topics().empty()) {
    const auto message = cursor->next();
    if (!message) break;
    const replay::Channel& source = channels_.channel(message->channel);
    const bool is_wanted = std::count(finder.topics().begin(), finder.topics().end(), source.topic);
    if (source.topic == kTransforms || source.topic == kStaticTransforms) {
      feedTransforms(*message, source);
    } else if (is_wanted && message->received.ns >= next_ns[source.topic]) {
      requireType<sensor_msgs::PointCloud2>(source);
      if (auto cloud = toMessage<sensor_msgs::PointCloud2>(message->bytes)) {
        clouds[source.topic] = std::move(*cloud);
        next_ns[source.topic] = message->received.ns + kCloudPatience;
      }
    }
    for (const auto& [topic, cloud] : clouds) {
      if (std::count(finder.topics().begin(), finder.topics().end(), topic) > 0) {
        finder.take(topic, cloud);
      }
    }
  }
  const std::vector<Finding> findings = finder.find();
  for (std::size_t i = 0; i < findings.size(); ++i) {
    if (surfaces[i].isMeasured()) scene_.takeSurface(i, findings[i]);
  }
  transforms_.clear();  // they come again, each when it is due
  feedEarlierTransforms();
}

SceneSnapshot RecordedScene::at(replay::Stamp moment) {
  while (next_ && next_->received <= moment) {
    feed(*next_);
    next_ = cursor_->next();
  }
  return scene_.snapshot(toTime(moment));
}

std::vector<std::string> RecordedScene::whyDark(const SceneSnapshot& snapshot,
                                                render::LightCensus& census, bool is_lit) const {
  const std::vector<LayerStatus> layers = status();
  const auto light = snapshot.T_projector_world
                         ? census.count(snapshot.scene, *snapshot.T_projector_world)
                         : std::vector<render::LayerCensus>();
  std::vector<std::string> reasons = darkReasons(snapshot.problems, layers, light);
  if (std::all_of(layers.begin(), layers.end(),
                  [](const LayerStatus& layer) { return layer.received == 0; })) {
    reasons.push_back("no message on any configured topic");
  }
  if (!is_lit && reasons.empty()) reasons.push_back("nothing is shown at this moment");
  return reasons;
}

void RecordedScene::feed(const replay::Message& message) {
  const replay::Channel& source = channels_.channel(message.channel);
  if (source.topic == kTransforms || source.topic == kStaticTransforms) {
    feedTransforms(message, source);
    return showWaiting(message.received);
  }
  const std::optional<BaseConfig>& base = scene_.config().base;
  if (base && source.topic == base->command_topic) {
    requireType<geometry_msgs::Twist>(source);
    const auto command = toMessage<geometry_msgs::Twist>(message.bytes);
    if (command) scene_.addCommand(*command, toTime(message.received));
  }
  const auto [begin, end] = layers_.equal_range(source.topic);
  for (auto layer = begin; layer != end; ++layer) feedLayer(layer->second, message, source);
}

/// Shows content that waits while tf2 remembers its time, however far ahead the next image is.
void RecordedScene::showWaiting(replay::Stamp now) {
  if (now.ns < show_waiting_at_ns_ || !scene_.isWaiting()) return;
  scene_.update(toTime(now));
  show_waiting_at_ns_ = now.ns + kWaitingPeriod;
}

void RecordedScene::feedTransforms(const replay::Message& message, const replay::Channel& channel) {
  requireType<tf2_msgs::TFMessage>(channel);
  const auto transforms = toMessage<tf2_msgs::TFMessage>(message.bytes);
  if (!transforms) return;  // one lost transform is bridged by the next
  for (const geometry_msgs::TransformStamped& transform : transforms->transforms) {
    // One that is refused does not end the recording, either.
    storeTransform(transforms_, transform, channel.caller_id, channel.topic == kStaticTransforms,
                   toTime(message.received));
  }
}

void RecordedScene::feedLayer(std::size_t layer, const replay::Message& message,
                              const replay::Channel& channel) {
  const LayerConfig& config = scene_.config().layers[layer];
  const auto feed = [&](auto tag) {
    feedLayerAs<typename decltype(tag)::Type>(layer, message, channel);
  };
  if (channel.topic == config.topic) return withMessageType(config.type, feed);
  withSecondType(config.type, feed);
}

template <typename MessageType>
void RecordedScene::feedLayerAs(std::size_t layer, const replay::Message& message,
                                const replay::Channel& channel) {
  requireType<MessageType>(channel);
  // What waits for a transform gets it in the order of the recording.
  scene_.update(toTime(message.received));
  if (const auto typed = toMessage<MessageType>(message.bytes)) {
    scene_.add(layer, *typed, toTime(message.received));
  } else {
    scene_.drop(layer, "bytes are no message");
  }
}

}  // namespace afterglow::nodes
