#include "replay/play/player.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <utility>

namespace afterglow::replay {
namespace {

constexpr std::int64_t kMillisecond = 1'000'000;
/// The first deadline lies this far ahead, so that the first message is no later than the others.
constexpr std::int64_t kLead = 5 * kMillisecond;
/// Later than that and overtaken by the next of its topic: not sent.
constexpr std::int64_t kStale = 2 * kMillisecond;
/// A base that hears nothing stops after so long (0.25 s on a Fetch): an older velocity would start
/// it again at a time of nobody's choosing.
constexpr std::int64_t kVelocityHolds = 250 * kMillisecond;
/// Motion that is later than this is no replay of what happened any more.
constexpr std::int64_t kMotionStalled = 1000 * kMillisecond;
/// ROS time was stepped, or is not the machine's: stamps follow.
constexpr std::int64_t kClockStep = 50 * kMillisecond;

bool isReplacing(const std::string& type) {
  constexpr const char* kTypes[] = {"sensor_msgs/PointCloud2", "sensor_msgs/LaserScan",
                                    "nav_msgs/Path", "sensor_msgs/Image", "nav_msgs/OccupancyGrid"};
  return std::find(std::begin(kTypes), std::end(kTypes), type) != std::end(kTypes);
}

bool isGoal(const Channel& channel) {
  const std::string ending = "ActionGoal";
  return channel.type.size() > ending.size() &&
         channel.type.compare(channel.type.size() - ending.size(), ending.size(), ending) == 0;
}

/// The six numbers at the end of a Twist or TwistStamped.
std::vector<double> velocityOf(const Bytes& bytes) {
  std::vector<double> velocity(6, std::nan(""));
  const std::size_t size = velocity.size() * sizeof(double);
  if (bytes.size() >= size) {
    std::memcpy(velocity.data(), bytes.data() + bytes.size() - size, size);
  }
  return velocity;
}

bool isFinite(const std::vector<double>& velocity) {
  return std::all_of(velocity.begin(), velocity.end(), [](double v) { return std::isfinite(v); });
}

bool isZero(const std::vector<double>& velocity) {
  return std::all_of(velocity.begin(), velocity.end(), [](double v) { return v == 0; });
}

}  // namespace

Player::Player(const Store& store, const PlayPlan& plan, const PlayOptions& options,
               MessageSink& sink, Clock& clock, std::function<Stamp()> ros_now,
               Rewriter::FreshId ids)
    : store_(store),
      plan_(plan),
      options_(options),
      sink_(sink),
      clock_(clock),
      ros_now_(std::move(ros_now)),
      rewriter_(std::move(ids)) {
  for (const PlannedTopic& planned : plan_.topics) {
    if (planned.isPlayed()) {
      Topic& topic = topics_[planned.channel.topic];
      topic.planned = &planned;
      topic.is_velocity = isVelocity(planned.channel);
      topic.is_replacing =
          isReplacing(planned.channel.type) || topic.is_velocity || isGoal(planned.channel);
    }
  }
}

Player::~Player() = default;

// ----------------------------------------------------------------------------- from other threads

void Player::stop(const std::string& reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!stop_reason_) {
    stop_reason_ = reason;
  }
  if (prefetch_) {
    prefetch_->cancel();
  }
  clock_.wake();
}

void Player::pause() {
  const std::lock_guard<std::mutex> lock(mutex_);
  is_pause_wanted_ = true;
  clock_.wake();
}

void Player::resume() {
  const std::lock_guard<std::mutex> lock(mutex_);
  is_pause_wanted_ = false;
  clock_.wake();
}

void Player::onGoalStatus(const std::string& id, std::uint8_t goal_status) {
  if (goals_.finish(id, outcomeOf(goal_status))) {
    clock_.wake();
  }
}

PlayProgress Player::progress() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  PlayProgress progress;
  progress.published = published_;
  if (timeline_) {
    const std::int64_t position = timeline_->position(clock_.now()).ns;
    progress.position.ns = std::clamp<std::int64_t>(position, 0, plan_.durationNs());
    progress.state =
        timeline_->isPaused() ? PlayProgress::State::Paused : PlayProgress::State::Playing;
  }
  return progress;
}

bool Player::isStopped() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return stop_reason_.has_value();
}

// ---------------------------------------------------------------------------------------- playing

PlayReport Player::run() {
  try {
    play();
  } catch (const std::exception& error) {
    stop(error.what());
  }
  finish();
  const std::lock_guard<std::mutex> lock(mutex_);
  report_.is_complete = !stop_reason_;
  report_.reason = stop_reason_.value_or("");
  report_.goals = goals_.counts();
  for (const PlannedTopic& planned : plan_.topics) {
    const auto topic = topics_.find(planned.channel.topic);
    const bool is_played = planned.isPlayed() && topic != topics_.end();
    report_.topics.emplace_back(planned, is_played ? topic->second.report : TopicReport{});
  }
  return report_;
}

void Player::play() {
  if (topics_.empty()) {
    throw std::runtime_error("no topic of this behavior is to be played");
  }
  Prefetch& prefetch = startReading();
  prefetch.fill();
  startTimeline();
  while (const Message* next = prefetch.front()) {
    if (!waitUntil(next->received)) {
      return;
    }
    playDue(prefetch);
  }
  if (waitUntil(plan_.end)) {
    measureLength();
    sendZeroVelocities();
    waitForGoals();
  }
}

Prefetch& Player::startReading() {
  auto cursor = store_.messages(plan_.behavior, {plan_.playedTopics(), {}, {}});
  const std::lock_guard<std::mutex> lock(mutex_);
  prefetch_ = std::make_unique<Prefetch>(std::move(cursor), options_.prefetch_bytes);
  if (stop_reason_) {
    prefetch_->cancel();
  }
  return *prefetch_;
}

void Player::startTimeline() {
  const std::lock_guard<std::mutex> lock(mutex_);
  timeline_.emplace(plan_.behavior.begin, options_.rate, clock_.now().after(kLead));
}

void Player::measureLength() {
  report_.actual_ns = static_cast<std::int64_t>(
      static_cast<double>(timeline_->position(clock_.now()).ns) / options_.rate);
}

void Player::playDue(Prefetch& prefetch) {
  std::vector<Due> batch;
  const SteadyTime now = clock_.now();
  while (const Message* next = prefetch.ready()) {
    const SteadyTime deadline = timeline_->deadline(next->received);
    if (now < deadline) {
      break;
    }
    const Channel& channel = channelOf(next->channel);
    batch.push_back({prefetch.pop(), &channel, topicOf(channel), deadline});
  }
  for (std::size_t i = 0; i < batch.size() && !isStopped(); ++i) {
    if (!batch[i].topic) {
      continue;
    }
    if (isOvertaken(batch, i, now)) {
      ++batch[i].topic->report.skipped;
    } else {
      send(batch[i]);
    }
  }
}

bool Player::isOvertaken(const std::vector<Due>& batch, std::size_t index, SteadyTime now) const {
  const Due& due = batch[index];
  return due.topic->is_replacing && now.ns - due.deadline.ns > kStale &&
         std::any_of(batch.begin() + static_cast<std::ptrdiff_t>(index) + 1, batch.end(),
                     [&](const Due& later) { return later.topic == due.topic; });
}

void Player::send(Due& due) {
  const std::int64_t late_ns = clock_.now().ns - due.deadline.ns;
  if (isTooLate(due, late_ns)) {
    ++due.topic->report.skipped;
    return;
  }
  publish(*due.topic, *due.channel, due.message.received, std::move(due.message.bytes), late_ns);
}

bool Player::isTooLate(const Due& due, std::int64_t late_ns) const {
  if (due.topic->is_velocity) {
    return late_ns > kVelocityHolds && !isZero(velocityOf(due.message.bytes));
  }
  if (due.topic->planned->modality == Modality::Body && late_ns > kMotionStalled) {
    throw std::runtime_error("stalled: motion on " + due.channel->topic + " is " +
                             std::to_string(late_ns / kMillisecond) + " ms late");
  }
  return false;
}

void Player::publish(Topic& topic, const Channel& channel, Stamp received, Bytes bytes,
                     std::int64_t late_ns) {
  try {
    if (channel.md5 != topic.planned->channel.md5) {
      throw MessageError("the topic began with another definition");
    }
    if (topic.is_velocity && !isFinite(velocityOf(bytes))) {
      throw MessageError("a velocity that is no number");
    }
    const Bytes recorded = isGoal(channel) ? bytes : Bytes();
    const Rewritten rewritten = rewriter_.rewrite(channel, momentOf(received, late_ns), bytes);
    if (!rewritten.publish) {
      return;
    }
    topic.has_moved = topic.has_moved || topic.is_velocity;
    topic.report.was_heard = sink_.publish(topic.planned->channel, bytes);
    topic.report.lateness.add(late_ns);
    ++topic.report.published;
    if (rewritten.goal && topic.report.was_heard) {
      goals_.add({channel, recorded, received, rewritten.goal->id});
    }
  } catch (const std::exception& error) {
    ++topic.report.refused;
    topic.report.problem = error.what();
    return;
  }
  if (topic.planned->modality == Modality::Ar) {
    topic.last = std::move(bytes);
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  ++published_;
}

PublishMoment Player::momentOf(Stamp received, std::int64_t late_ns) {
  const Stamp now = ros_now_();
  const std::int64_t shift = now.ns - late_ns - received.ns;
  // One shift for all, so that stamps that were equal stay equal.
  const bool is_constant = options_.rate == 1.0 && shift_ns_;
  if (!is_constant || std::abs(shift - *shift_ns_) > kClockStep) {
    shift_ns_ = shift;
  }
  return {now, *shift_ns_};
}

const Channel& Player::channelOf(std::int64_t id) {
  const auto known = channels_.find(id);
  return known != channels_.end() ? known->second
                                  : channels_.emplace(id, store_.channel(id)).first->second;
}

Player::Topic* Player::topicOf(const Channel& channel) {
  const auto found = topics_.find(channel.topic);
  return found == topics_.end() ? nullptr : &found->second;
}

}  // namespace afterglow::replay
