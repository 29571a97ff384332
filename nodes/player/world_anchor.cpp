#include "nodes/player/world_anchor.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"

namespace afterglow::nodes {
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
  const replay::HeaderFields fields(replay::Schema::parse(channel.type, channel.definition));
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
    const replay::Schema schema = replay::Schema::parse(channel.type, channel.definition);
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

}  // namespace afterglow::nodes
