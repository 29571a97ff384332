#include "nodes/player/world_anchor.hpp"

#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <optional>
#include <stdexcept>
#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/conversion/typed_message.hpp"
#include "nodes/projector/frame_lookup.hpp"
#include "nodes/projector/recorded_scene.hpp"
#include "nodes/projector/transform_listener.hpp"
#include "replay/record/snapshot.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kBefore = 10 * kSecond;  ///< the time that tf2 remembers
constexpr std::int64_t kKept = 30 * kSecond;    ///< the time kept in the buffer
/// A transform that comes later than that did not help then.
constexpr std::int64_t kPatience = 2 * kSecond;

}  // namespace

RecordedFrames::RecordedFrames(const replay::Store& store, const replay::Behavior& behavior,
                               std::string anchor)
    : store_(store),
      behavior_(behavior),
      anchor_(std::move(anchor)),
      robot_(replay::recordedRobot(behavior).value_or(replay::RobotNames())),
      buffer_(ros::Duration(static_cast<double>(kKept / kSecond))) {
  behavior_.end = replay::Stamp{endOf(store, behavior).ns + kPatience};
  restart(behavior.begin);
}

std::optional<Eigen::Isometry3d> RecordedFrames::at(const std::string& frame, replay::Stamp moment,
                                                    Wanted wanted) {
  if (!isFrameName(frame)) return std::nullopt;
  readTo(moment);
  auto T_anchor_frame = look(frame, moment);
  while (!T_anchor_frame && read_to_.ns < moment.ns + kPatience && read()) {
    T_anchor_frame = look(frame, moment);
  }
  if (T_anchor_frame || wanted == Wanted::Exact) return T_anchor_frame;
  if (!buffer_.canTransform(anchor_, frame, ros::Time(0))) return std::nullopt;
  const auto newest = buffer_.lookupTransform(anchor_, frame, ros::Time(0));
  if (std::abs(moment.ns - toStamp(newest.header.stamp).ns) > kStalePoseNs) return std::nullopt;
  return toIsometry(newest.transform);
}

void RecordedFrames::readTo(replay::Stamp moment) {
  const std::int64_t held_from = std::max(begin_.ns, read_to_.ns - kKept + 5 * kSecond);
  const bool is_ahead = cursor_ && moment.ns > read_to_.ns + kKept;
  if (moment.ns < held_from || is_ahead) restart(moment);
  while (read_to_ < moment && read()) {
  }
}

/// Static transforms first: they hold for all of the recording.
void RecordedFrames::restart(replay::Stamp moment) {
  buffer_.clear();
  replay::Behavior part = behavior_;
  part.begin = {};
  const auto fixed = store_.messages(part, {withOwn("/tf_static"), {}, {}});
  while (const auto message = fixed->next()) feed(*message, true);
  begin_ = {std::max<std::int64_t>(0, moment.ns - kBefore)};
  part.begin = read_to_ = begin_;
  cursor_ = store_.messages(part, {withOwn("/tf"), {}, {}});
}

/// A robot in a namespace may have its transforms there.
std::vector<std::string> RecordedFrames::withOwn(const std::string& topic) const {
  std::vector<std::string> topics{topic};
  if (!robot_.name_space.empty()) topics.push_back(robot_.name_space + topic);
  return topics;
}

bool RecordedFrames::read() {
  const std::optional<replay::Message> message = cursor_ ? cursor_->next() : std::nullopt;
  if (!message) {
    cursor_.reset();
    return false;
  }
  read_to_ = message->received;
  feed(*message, false);
  return true;
}

void RecordedFrames::feed(const replay::Message& message, bool is_static) {
  const auto transforms = toMessage<tf2_msgs::TFMessage>(message.bytes);
  if (!transforms) return;
  for (const geometry_msgs::TransformStamped& transform : transforms->transforms) {
    storeTransform(buffer_, transform, "recording", is_static, ros::Time());
  }
}

std::optional<Eigen::Isometry3d> RecordedFrames::look(const std::string& frame,
                                                      replay::Stamp moment) const {
  if (!buffer_.canTransform(anchor_, frame, toTime(moment))) return std::nullopt;
  return toIsometry(buffer_.lookupTransform(anchor_, frame, toTime(moment)).transform);
}

namespace {

using Wanted = RecordedFrames::Wanted;

/// Frames that are told again and again; more are told with each message only.
constexpr std::size_t kMostFrames = 256;
/// Messages of a topic that are looked at for the first one that names a frame.
constexpr int kFirstMessages = 20;
constexpr std::int64_t kReadAhead = 3'000'000'000;

bool isMoved(const std::string& frame, const replay::AnchorSettings& settings) {
  return !frame.empty() && frame != settings.frame;
}

/// The header that counts for whether a topic can be placed.
std::optional<replay::HeaderFields::Header> firstMoved(const replay::Store& store,
                                                       const replay::PlayPlan& plan,
                                                       const replay::Channel& channel,
                                                       const replay::AnchorSettings& settings) {
  const replay::HeaderFields fields(replay::Schema::of(channel));
  const auto messages = store.messages(plan.behavior, {{channel.topic}, {}, {}});
  for (int i = 0; i < kFirstMessages; ++i) {
    const std::optional<replay::Message> message = messages->next();
    if (!message) break;
    if (store.channel(message->channel).md5 != channel.md5) continue;
    for (replay::HeaderFields::Header header : fields.find(message->bytes)) {
      if (!isMoved(header.frame, settings)) continue;
      if (header.stamp.ns == 0) header.stamp = message->received;
      return header;
    }
  }
  return std::nullopt;
}

}  // namespace

WorldAnchor::WorldAnchor(const replay::Store& store, const replay::PlayPlan& plan,
                         replay::AnchorSettings settings, Publish publish)
    : plan_(plan),
      settings_(std::move(settings)),
      publish_(std::move(publish)),
      recorded_(store, plan.behavior, settings_.frame) {}

bool WorldAnchor::refuseUnplaced(const replay::Store& store, replay::PlayPlan& plan,
                                 const replay::AnchorSettings& settings) {
  std::optional<RecordedFrames> recorded;
  bool is_needed = false;
  for (replay::PlannedTopic& topic : plan.topics) {
    if (!topic.isPlayed() || settings.of(topic.channel) != replay::Anchor::World) continue;
    try {
      const auto header = firstMoved(store, plan, topic.channel, settings);
      if (!header) continue;
      if (!recorded) recorded.emplace(store, plan.behavior, settings.frame);
      if (recorded->at(header->frame, header->stamp, Wanted::Newest)) {
        is_needed = true;
      } else {
        topic.why_not = "the recording does not say where its frame '" + printable(header->frame) +
                        "' was in '" + settings.frame + "'; --anchor " + topic.channel.topic +
                        "=body shows it where that is today";
      }
    } catch (const replay::MessageError& error) {
      topic.why_not = error.what();
    }
  }
  return is_needed;
}

void WorldAnchor::anchor(const replay::Channel& channel, replay::Stamp received,
                         const replay::PublishMoment& moment, replay::Bytes& bytes) {
  if (settings_.of(channel) != replay::Anchor::World) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  const std::vector<replay::HeaderFields::Header> headers = fieldsOf(channel).find(bytes);
  // A stamp of its own: other messages without one may be of other moments, shown at this one.
  last_stamped_.ns = std::max(last_stamped_.ns + 1, moment.now.ns - moment.shift_ns);
  std::set<std::pair<std::string, replay::Stamp>> placed;
  std::vector<replay::FieldSpan> renamed;
  tf2_msgs::TFMessage transforms;
  for (const auto& header : headers) {
    if (!isMoved(header.frame, settings_)) continue;
    const bool is_stamped = header.stamp.ns != 0;
    const replay::Stamp stamp = is_stamped ? header.stamp : last_stamped_;
    if (!is_stamped) writeTime(bytes, header.stamp_span, stamp);
    renamed.push_back(header.frame_span);
    if (!placed.insert({header.frame, stamp}).second) continue;
    place(header.frame, is_stamped ? stamp : received, is_stamped ? Wanted::Exact : Wanted::Newest,
          {stamp.ns + moment.shift_ns}, transforms);
    if (frames_.size() < kMostFrames) frames_.insert(header.frame);
  }
  editStrings(bytes, renamed, replay::recordedFrame);
  if (!transforms.transforms.empty()) publish_(transforms);
}

void WorldAnchor::repeat(replay::Stamp recorded, replay::Stamp now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  tf2_msgs::TFMessage transforms;
  const auto unplaced = unplaced_;  // only what belongs to a message counts
  for (const std::string& frame : frames_) {
    place(frame, recorded, Wanted::Newest, now, transforms);
  }
  unplaced_ = unplaced;
  recorded_.readTo({recorded.ns + kReadAhead});
  if (!transforms.transforms.empty()) publish_(transforms);
}

void WorldAnchor::readAhead(replay::Stamp recorded) {
  const std::lock_guard<std::mutex> lock(mutex_);
  recorded_.readTo({recorded.ns + kReadAhead});
}

std::vector<std::string> WorldAnchor::notes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::string> notes;
  for (const auto& [frame, count] : unplaced_) {
    notes.push_back("the recording does not say where '" + printable(frame) + "' was in '" +
                    settings_.frame + "' for " + std::to_string(count) +
                    " messages: their light stays off");
  }
  return notes;
}

const replay::HeaderFields& WorldAnchor::fieldsOf(const replay::Channel& channel) {
  const std::string key = channel.md5 + channel.type;
  auto known = fields_.find(key);
  if (known == fields_.end()) {
    const replay::Schema schema = replay::Schema::of(channel);
    known = fields_.emplace(key, replay::HeaderFields(schema)).first;
  }
  return known->second;
}

void WorldAnchor::place(const std::string& frame, replay::Stamp moment, Wanted wanted,
                        replay::Stamp published, tf2_msgs::TFMessage& transforms) {
  const auto T_anchor_frame = recorded_.at(frame, moment, wanted);
  if (!T_anchor_frame) {
    if (unplaced_.size() < kMostFrames || unplaced_.count(frame) > 0) ++unplaced_[frame];
    return;
  }
  // Two topics of one moment: tf wants to hear it once.
  const auto [told, is_new] = told_.emplace(frame, published);
  if (!is_new && std::exchange(told->second, published) == published) return;
  geometry_msgs::TransformStamped transform;
  transform.header.stamp = toTime(published);
  transform.header.frame_id = plan_.rewriting.frame(settings_.frame);
  transform.child_frame_id = plan_.rewriting.frame(replay::recordedFrame(frame));
  transform.transform = toTransform(*T_anchor_frame);
  transforms.transforms.push_back(transform);
}

namespace {

constexpr std::uint32_t kTransformQueue = 100;  // tf2_ros's
constexpr double kPeriod_s = 1.0 / 30;

}  // namespace

AnchorBroadcast::AnchorBroadcast(const replay::Store& store, const replay::PlayPlan& plan,
                                 const replay::AnchorSettings& settings, Position position)
    : anchor_(plan.rewriting.frame(settings.frame)),
      position_(std::move(position)),
      world_(store, plan, settings,
             [this](const tf2_msgs::TFMessage& transforms) { publish(transforms); }) {
  world_.readAhead(plan.begin);
  publisher_ = node_.advertise<tf2_msgs::TFMessage>("/tf", kTransformQueue);
  for (const char* topic : {"/tf", "/tf_static"}) {
    thread_.hear<Event>(topic, kTransformQueue,
                        [this](const Event& event) { onTransforms(event); });
  }
  thread_.every(kPeriod_s, [this] { onTimer(); });
  thread_.begin();
}

void AnchorBroadcast::anchor(const replay::Channel& channel, replay::Stamp received,
                             const replay::PublishMoment& moment, replay::Bytes& bytes) {
  world_.anchor(channel, received, moment, bytes);
}

void AnchorBroadcast::onTransforms(const Event& event) {
  if (has_anchor_ || event.getPublisherName() == ros::this_node::getName()) return;
  for (const geometry_msgs::TransformStamped& transform : event.getConstMessage()->transforms) {
    if (frameName(transform.header.frame_id) == anchor_ ||
        frameName(transform.child_frame_id) == anchor_) {
      has_anchor_ = true;
    }
  }
  if (has_anchor_) thread_.hearNoMore();
}

void AnchorBroadcast::publish(const tf2_msgs::TFMessage& transforms) {
  if (!has_anchor_) {
    throw std::runtime_error("today's tf has no frame '" + anchor_ +
                             "' (--anchor-frame) for light to stay in place in");
  }
  publisher_.publish(transforms);
}

void AnchorBroadcast::onTimer() {
  const std::optional<Moment> moment = position_();
  if (!moment || !has_anchor_) return;
  try {
    world_.repeat(moment->recorded, moment->now);
  } catch (const std::exception& error) {
    ROS_WARN_THROTTLE(10, "recorded frames: %s", error.what());
  }
}

}  // namespace afterglow::nodes
