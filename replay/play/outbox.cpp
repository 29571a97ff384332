#include "replay/play/outbox.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <string>
#include <utility>

#include "replay/messages/document.hpp"
#include "replay/messages/schema.hpp"
#include "replay/motion/motion_limits.hpp"
#include "replay/motion/planar_pose.hpp"
#include "replay/play/message_lanes.hpp"

namespace afterglow::replay {

double ArmLead::leadFor(const std::vector<std::optional<RestNeed>>& needs) {
  const bool is_expected = std::exchange(is_elsewhere_expected_, false);
  double lead_s = 0;
  for (const std::optional<RestNeed>& need : needs) {
    const bool takes_lead = is_expected && (!need || need->is_elsewhere);
    lead_s = std::max({lead_s, need ? need->seconds : 0,
                       takes_lead ? play_.options.seek_lead_s : 0});
  }
  return lead_s;
}

void ArmLead::give(double seconds, Stamp at) {
  if (seconds <= 0) {
    return;
  }
  end_ = play_.clock.now().after(static_cast<std::int64_t>(seconds * 1e9));
  play_.transport.change([&](Timeline& timeline) { timeline.moveTo(at, end_); });
}

double ArmLead::left_s() const {
  return static_cast<double>(std::max<std::int64_t>(0, end_.ns - play_.clock.now().ns)) * 1e-9;
}

GoalProgress ArmLead::progress(Stamp begun, Stamp at) const {
  const double recorded_s = static_cast<double>(at.ns - begun.ns) * 1e-9;
  return {begun, at, recorded_s / play_.timeline().rate()};
}

void ArmLead::lookAtHalted() {
  look_ = SteadyTime::forever();
  if (arm()) arm()->halted();
}

void ArmLead::forget() {
  end_ = {};
  look_ = SteadyTime::forever();
  if (arm()) arm()->forgetHalted();
}

namespace {

constexpr std::int32_t kDeleteAll = 3;  // visualization_msgs/Marker

Value& member(Value& message, const std::string& name) {
  for (auto& [key, value] : std::get<Object>(message)) {
    if (key == name) {
      return value;
    }
  }
  throw MessageError("no field " + name);
}

/// All-zero bytes of the least size: numbers 0, strings and arrays empty.
Value blank(const Schema& schema) { return decode(schema, Bytes(schema.minimumSize(0))); }

Value blankWithFrame(const Schema& schema, Value& last) {
  Value message = blank(schema);
  member(member(message, "header"), "frame_id") = member(member(last, "header"), "frame_id");
  return message;
}

Value clearedCloud(Value last) {
  member(member(last, "header"), "stamp") = RosTime{};
  for (const char* size : {"width", "height", "row_step"}) {
    member(last, size) = std::uint32_t{0};
  }
  std::get<NumberArray>(member(last, "data")).bytes.clear();
  return last;
}

Value clearedMarker(const Schema& schema, Value& last) {
  Value marker = blankWithFrame(schema, last);
  member(marker, "action") = kDeleteAll;
  return marker;
}

/// An array of one blank Marker: its count, then zeros of a Marker's least size.
Value clearedMarkers(const Schema& schema) {
  const std::size_t marker_type = schema.root().fields.at(0).message;
  Bytes bytes(sizeof(std::uint32_t) + schema.minimumSize(marker_type));
  bytes[0] = 1;
  Value message = decode(schema, bytes);
  member(std::get<Array>(member(message, "markers")).front(), "action") = kDeleteAll;
  return message;
}

std::optional<Value> cleared(const std::string& type, const Schema& schema, Value last) {
  if (type == "sensor_msgs/PointCloud2") {
    return clearedCloud(std::move(last));
  }
  if (type == "sensor_msgs/LaserScan" || type == "nav_msgs/Path") {
    return blankWithFrame(schema, last);
  }
  if (type == "visualization_msgs/Marker") {
    return clearedMarker(schema, last);
  }
  if (type == "visualization_msgs/MarkerArray") {
    return clearedMarkers(schema);
  }
  return std::nullopt;
}

}  // namespace

std::optional<Bytes> clearingMessage(const Channel& channel, const Bytes& last) {
  try {
    const Schema schema = Schema::of(channel);
    const std::optional<Value> message = cleared(channel.type, schema, decode(schema, last));
    return message ? std::optional<Bytes>(encode(schema, *message)) : std::nullopt;
  } catch (const std::exception&) {  // MessageError, or a type of that name with other fields
    return std::nullopt;
  }
}

namespace {

/// Motion that is later than this does not repeat what happened.
constexpr std::int64_t kMotionStalled = 1'000'000'000;
/// ROS time was stepped, or is not the machine's: stamps follow.
constexpr std::int64_t kClockStep = 50'000'000;

}  // namespace

OutboxTopic::OutboxTopic(const PlannedTopic& topic, const PlayOptions& options, TopicReport& counts)
    : planned(topic),
      report(counts),
      scaling(Schema::of(topic.channel), hasJointVelocities(topic)),
      stop(topic.output, stopOf(topic)),
      is_velocity(stop.isSetPoint()),
      times_out(isVelocity(topic.channel)),
      is_command(stop.hasMessage() || isGoal(topic.channel)),
      is_replacing(isReplacing(topic.channel.type) || is_velocity || isGoal(topic.channel)),
      is_driven(options.base_drive && options.base_drive->topic() == topic.channel.topic),
      latency_s(latencyOf(options.latency_s, topic.modality)) {
  if (topic.modality == Modality::Body) numbers = Schema::of(topic.channel);
}

const Channel& OutboxTopic::outputOf(const Channel& recorded) {
  const auto known = std::find_if(outputs.begin(), outputs.end(), [&](const Channel& output) {
    return output.latching == recorded.latching &&
           (!output.latching || output.caller_id == recorded.caller_id);
  });
  if (known != outputs.end()) return *known;
  Channel output = planned.output;
  output.latching = recorded.latching;
  if (output.latching) output.caller_id = recorded.caller_id;
  outputs.push_back(std::move(output));
  return outputs.back();
}

Outbox::Outbox(const PlayContext& play, ArmLead& lead, MessageSink& sink,
               std::function<Stamp()> ros_now, Rewriter::FreshId ids)
    : play_(play),
      lead_(lead),
      sink_(sink),
      ros_now_(std::move(ros_now)),
      rewriter_(std::move(ids), play.plan.rewriting) {
  const PlayOptions& options = play.options;
  for (const PlannedTopic& planned : play.plan.topics) {
    const std::string& name = planned.channel.topic;
    if (planned.isPlayed()) {
      topics_.try_emplace(name, planned, options, play.ledger.topic(name));
    }
  }
  if (options.base_drive) topics_.at(options.base_drive->topic());  // has to be played
}

OutboxTopic* Outbox::find(const std::string& name) {
  const auto found = topics_.find(name);
  return found == topics_.end() ? nullptr : &found->second;
}

// ----------------------------------------------------------------------------------- a message out

bool Outbox::leavesOut(const Outgoing& message) const {
  const OutboxTopic& topic = message.topic;
  const bool is_body = topic.planned.modality == Modality::Body;
  // An older velocity would start the base again at a time that nobody chose.
  const bool is_too_late = topic.times_out && message.late_ns > kVelocityHoldsNs &&
                           !topic.stop.isNeutral(message.bytes);
  if (topic.is_driven) {
    ++topic.report.replaced;
  } else if (is_too_late) {
    ++topic.report.skipped;
  } else if (!topic.times_out && is_body && message.late_ns > kMotionStalled) {
    throw std::runtime_error("stalled: motion on " + message.channel.topic + " is " +
                             std::to_string(message.late_ns / 1'000'000) + " ms late");
  }
  return topic.is_driven || is_too_late;
}

std::optional<Outbox::Sent> Outbox::publish(Outgoing message) {
  OutboxTopic& topic = message.topic;
  const Modality modality = topic.planned.modality;
  std::optional<Sent> sent;
  try {
    sent = tryPublish(message);
  } catch (const ArmElsewhere& error) {
    refuse(message, error.what());
    const std::string& output = topic.planned.output.topic;
    play_.transport.stop("nothing more is sent on " + output + ": " + error.what());
  } catch (const std::exception& error) {
    refuse(message, error.what());
    if (modality != Modality::Body) {
      play_.transport.fail(modality, message.channel.topic + ": " + error.what());
    }
  }
  if (!sent) {
    return sent;
  }
  if (modality != Modality::Body && !sent->was_heard) {
    play_.transport.fail(modality, "nobody listened on " + topic.planned.output.topic);
  }
  if (modality == Modality::Ar) topic.last = std::move(message.bytes);
  ++published_;
  return sent;
}

/// Checks, rescales, begins where the joints are, anchors, rewrites, publishes, counts.
std::optional<Outbox::Sent> Outbox::tryPublish(Outgoing& message) {
  OutboxTopic& topic = message.topic;
  const Channel& channel = message.channel;
  const PublishMoment moment = message.moment ? *message.moment : momentOf(message);
  if (channel.md5 != topic.planned.channel.md5) {
    throw MessageError("the topic began with another definition");
  }
  if (topic.numbers) {
    const std::string odd = oddNumber(*topic.numbers, message.bytes);
    if (!odd.empty()) throw MessageError(odd);
  }
  const double rate = play_.timeline().rate();
  topic.scaling.apply(message.bytes, rate);
  beginWhereJointsAre(message);
  if (play_.options.anchor) {
    play_.options.anchor->anchor(channel, message.recorded, moment, message.bytes);
  }
  const Rewritten rewritten = rewriter_.rewrite(channel, moment, message.bytes);
  if (!rewritten.publish) {
    return std::nullopt;
  }
  if (topic.is_velocity) topic.moved_by = message.bytes;
  topic.report.was_heard = sink_.publish(topic.outputOf(channel), message.bytes);
  const SteadyTime now = play_.clock.now();
  const std::int64_t late_ns = std::min(message.late_ns, now.ns - message.released.ns);
  play_.ledger.addSent(topic.planned, {message.recorded, now, std::max<std::int64_t>(0, late_ns),
                                  topic.latency_s, rate});
  return Sent{topic.report.was_heard, rewritten.goal, rewritten.canceled};
}

PublishMoment Outbox::momentOf(const Outgoing& message) {
  if (play_.options.has_recorded_time) {
    return {message.at, 0};
  }
  const double rate = play_.timeline().rate();
  const std::int64_t early_ns = earlyNs(message.topic.latency_s, rate);
  const Stamp now = ros_now_();
  const std::int64_t shift = now.ns - message.late_ns - (message.at.ns - early_ns);
  // One shift for all, so that equal stamps stay equal. Messages that are sent early get stamps no
  // later than now: tf knows no future.
  const bool is_constant = rate == 1.0 && shift_ns_;
  if (!is_constant || std::abs(shift - *shift_ns_) > kClockStep) {
    shift_ns_ = shift;
  }
  return {now, *shift_ns_ - early_ns};
}

/// A goal that is sent during a lead gets the rest of that lead; one that is under way already goes
/// on where the joints are on its path.
void Outbox::beginWhereJointsAre(Outgoing& message) {
  const OutboxTopic& topic = message.topic;
  const bool has_joints = isTrajectoryCommand(message.channel) || isGoal(message.channel);
  const ArmStart* arm = lead_.arm();
  if (!arm || !has_joints || topic.planned.modality != Modality::Body) {
    return;
  }
  if (message.at > message.recorded) {
    message.bytes = arm->goOn(message.channel, message.bytes,
                              lead_.progress(message.recorded, message.at), lead_.left_s());
    return;
  }
  if (!lead_.isGiven()) {
    const double needed = arm->leadOf(message.channel, message.bytes, message.at).value_or(0);
    if (needed > 0) {
      sendZeroVelocities();
      lead_.give(needed, message.at);
      forgetShift();
    }
  }
  message.bytes = arm->begin(message.channel, message.bytes, message.at, lead_.left_s());
}

void Outbox::refuse(const Outgoing& message, const std::string& why) {
  ++message.topic.report.refused;
  message.topic.report.problem = why;
}

// -------------------------------------------------------------------- messages of the player's own

void Outbox::sendDriven(const Bytes& velocity) {
  OutboxTopic& topic = topics_.at(play_.options.base_drive->topic());
  topic.moved_by = velocity;
  topic.report.was_heard = sink_.publish(topic.planned.output, velocity);
  ++topic.report.published;
}

/// Sends a message; at the end one that cannot be sent must not keep the others from being sent.
void Outbox::send(const Channel& channel, const Bytes& bytes) {
  try {
    sink_.publish(channel, bytes);
  } catch (const std::exception& error) {
    play_.ledger.note(channel.topic + ": " + error.what());
  }
}

void Outbox::sendZeroVelocities() {
  if (play_.options.base_drive) play_.options.base_drive->rest();
  for (const auto& [name, topic] : topics_) sendZeroVelocity(topic);
}

void Outbox::standStill() {
  for (const auto& [name, topic] : topics_) {
    if (!topic.is_driven) sendZeroVelocity(topic);
  }
}

void Outbox::sendZeroVelocity(const OutboxTopic& topic) {
  if (!topic.moved_by.empty()) send(topic.stop.channel(), topic.stop.after(topic.moved_by));
}

bool Outbox::isLit() const {
  return std::any_of(topics_.begin(), topics_.end(),
                     [](const auto& entry) { return !entry.second.last.empty(); });
}

void Outbox::clearProjection() {
  for (auto& [name, topic] : topics_) {
    if (topic.last.empty()) {
      continue;
    }
    if (const auto nothing = clearingMessage(topic.planned.channel, topic.last)) {
      for (const Channel& output : topic.outputs) send(output, *nothing);
    }
    topic.last.clear();
  }
}

double Outbox::latency() const {
  double longest = 0;
  for (const auto& [name, topic] : topics_) longest = std::max(longest, topic.latency_s);
  return longest;
}

}  // namespace afterglow::replay
