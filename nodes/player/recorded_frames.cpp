#include "nodes/player/recorded_frames.hpp"

#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "nodes/conversion/frame_name.hpp"
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

}  // namespace afterglow::nodes
