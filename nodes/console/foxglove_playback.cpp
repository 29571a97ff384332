#include "nodes/console/foxglove_playback.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "replay/messages/foreign_json.hpp"
#include "replay/play/scene_at.hpp"
#include "replay/record/snapshot.hpp"
#include "replay/store/store_reading.hpp"

namespace afterglow::nodes {
namespace {

using replay::Stamp;
using replay::SteadyTime;
using std::chrono::steady_clock;

constexpr std::size_t kReadAhead = 8 << 20;  // bytes
constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::chrono::nanoseconds kTick{kSecond / 60};  // between times that are told
constexpr std::chrono::milliseconds kStall{20};          // until a slow client is looked at again
constexpr std::chrono::hours kLongest{1};  // the farthest deadline: none is a time that overflows

SteadyTime steadyNow() {
  return {steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1)};
}

std::pair<std::int64_t, std::uint64_t> placeOf(const replay::Message& message) {
  return {message.received.ns, message.sequence};
}

/// Throws std::runtime_error, one line.
double possibleRate(double rate) {
  const std::string why = replay::whyNoRate(rate);
  if (!why.empty()) throw std::runtime_error(why);
  return rate;
}

}  // namespace

FoxglovePlayback::FoxglovePlayback(const replay::Store& store, replay::Behavior behavior,
                                   std::shared_ptr<FrameQueue> frames, const PlaybackStart& start)
    : FoxgloveSession(std::move(frames)),
      store_(store),
      behavior_(std::move(behavior)),
      has_controls_(start.has_controls),
      timeline_(behavior_.begin, possibleRate(start.rate), steadyNow()) {
  readTopics();
  settle();
  moveTo({behavior_.begin.ns + std::llround(start.t * 1e9)});
  std::vector<FoxgloveChannel> channels;
  for (const auto& [name, topic] : topics_) channels.push_back(topic.channel);
  FoxgloveServerInfo info{
      "Afterglow: " + behavior_.name + " (" + std::to_string(behavior_.id) + ")",
      {"time", "parameters"},
      {{behavior_.begin, end_}}};
  if (has_controls_) info.capabilities.emplace_back("playbackControl");
  greet(info, channels);
  tell();
  thread_ = std::thread([this] { run(); });
}

FoxglovePlayback::~FoxglovePlayback() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

/// A topic of several types is announced as it began; messages of the others are left out.
void FoxglovePlayback::readTopics() {
  end_ = std::max(behavior_.begin, behavior_.end.value_or(behavior_.begin));
  std::vector<replay::TopicSummary> summaries = store_.topics(behavior_);
  for (auto& summary : store_.contextTopics(behavior_)) summaries.push_back(std::move(summary));
  std::sort(summaries.begin(), summaries.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const replay::TopicSummary& summary : summaries) {
    if (summary.count == 0) continue;
    if (!behavior_.end) end_ = std::max(end_, summary.last);
    replay::MessageRange range{{summary.topic}, summary.first, Stamp{summary.first.ns + 1}};
    const auto first = store_.messages(behavior_, range)->next();
    if (!first) continue;
    const replay::Channel& channel = channelOf(first->channel);
    const auto id = static_cast<std::uint32_t>(topics_.size() + 1);
    topics_.try_emplace(summary.topic,
                        Topic{{id, summary.topic, channel.type, channel.definition, channel.md5},
                              channel.latching});
  }
}

// ---------------------------------------------------------------------------- requests, any thread

void FoxglovePlayback::begin(const FoxgloveSubscription& subscription,
                             const FoxgloveChannel& channel) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!orders_) orders_.emplace();
  orders_->begins[subscription.id] = channel.topic;
}

void FoxglovePlayback::end(std::uint32_t subscription) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!orders_) orders_.emplace();
    orders_->begins.erase(subscription);
    orders_->ends.push_back(subscription);
  }
  changed_.notify_all();
}

void FoxglovePlayback::control(const PlaybackRequest& request) {
  possibleRate(request.speed);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!orders_) orders_.emplace();
    orders_->controls.push_back(request);
  }
  changed_.notify_all();
}

FoxgloveParameters FoxglovePlayback::parameters() {
  FoxgloveParameters told{{"/behavior/id", behavior_.id},
                          {"/behavior/name", behavior_.name},
                          {"/behavior/outcome", behavior_.outcome},
                          {"/behavior/robot", behavior_.robot},
                          {"/behavior/tags", behavior_.tags}};
  const auto given = replay::parseForeignJson<nlohmann::json>(behavior_.parameters);
  for (const auto& [name, value] : given.items()) told["/behavior/parameters/" + name] = value;
  const std::string urdf = replay::recordedUrdf(behavior_);
  if (const auto text = urdf.empty() ? std::nullopt : store_.file(urdf)) {
    told["/robot_description"] = std::string(text->begin(), text->end());
  }
  return told;
}

// ------------------------------------------------------------------------------ the playing thread

void FoxglovePlayback::run() {
  SteadyPoint due = steady_clock::now();
  while (true) {
    Orders orders;
    {
      std::unique_lock<std::mutex> lock(mutex_);
      changed_.wait_until(lock, due, [this] { return is_ending_ || orders_; });
      if (is_ending_) return;
      if (orders_) orders = *std::exchange(orders_, std::nullopt);
    }
    try {
      obey(orders);
      due = std::min(playOn(), steady_clock::now() + kLongest);
    } catch (const std::exception& error) {  // the store cannot be read
      say(FoxgloveLevel::Error, error.what());
      is_paused_ = true;
      reader_.reset();
      settle();
      tell();
      due = steady_clock::now() + kLongest;
    }
  }
}

void FoxglovePlayback::obey(const Orders& orders) {
  for (const std::uint32_t id : orders.ends) {
    const auto ended = std::find_if(subscriptions_.begin(), subscriptions_.end(),
                                    [id](const auto& known) { return known.second == id; });
    if (ended != subscriptions_.end()) subscriptions_.erase(ended);
  }
  bool has_sought = false;
  for (const PlaybackRequest& request : orders.controls) has_sought |= apply(request);
  if (has_sought) {
    told_ = {};
    sendTime({next_.first});
    for (const auto& [topic, subscription] : subscriptions_) sendState(topic, subscription);
  }
  for (const auto& [subscription, topic] : orders.begins) {
    subscriptions_[topic] = subscription;
    sendTime({next_.first});
    sendState(topic, subscription);
  }
  has_begun_ |= !orders.begins.empty();
  if (has_sought || !orders.begins.empty() || !orders.ends.empty()) openReader();
  settle();
}

/// Returns true if it moved to another moment.
bool FoxglovePlayback::apply(const PlaybackRequest& request) {
  timeline_.setRate(request.speed, steadyNow());
  is_paused_ = !request.plays;
  const bool begins_anew = has_ended_ && request.plays && !request.seek;
  const bool moves = request.seek || begins_anew;
  if (moves) moveTo(request.seek.value_or(behavior_.begin));
  settle();
  tell(moves, request.id);
  return moves;
}

/// What came at that very moment is in force there, but at the begin, where all is still to come.
void FoxglovePlayback::moveTo(Stamp moment) {
  const Stamp to = std::clamp(moment, behavior_.begin, end_);
  timeline_.moveTo(to, steadyNow());
  const bool is_begin = to == behavior_.begin;
  next_ = {to.ns, is_begin ? 0 : std::numeric_limits<std::uint64_t>::max()};
  has_ended_ = false;
}

/// The timeline runs or stands, as all of its reasons have it.
void FoxglovePlayback::settle() {
  const bool stands = is_paused_ || is_stalled_ || has_ended_ || !has_begun_;
  stands ? timeline_.pause(steadyNow()) : timeline_.resume(steadyNow());
}

void FoxglovePlayback::sendState(const std::string& topic, std::uint32_t subscription) {
  for (const replay::Message& message : stateOf(topics_.at(topic))) {
    send(message, subscription, {next_.first});
  }
}

std::vector<replay::Message> FoxglovePlayback::stateOf(const Topic& topic) {
  const std::string& name = topic.channel.topic;
  const bool is_added_up = topic.is_latched || replay::isMarkers(topic.channel.type);
  const bool is_transforms = topic.channel.type == "tf2_msgs/TFMessage";
  if (!is_added_up && !is_transforms) {
    auto newest = replay::newestMessage(store_, behavior_, name, {next_.first});
    if (!newest || placeOf(*newest) >= next_) return {};
    return {std::move(*newest)};
  }
  replay::MessageRange range{{name}, behavior_.begin, Stamp{next_.first + 1}};
  if (!is_added_up) range.begin = Stamp{std::max(behavior_.begin.ns, next_.first - kSecond)};
  std::vector<replay::Message> messages;
  replay::SceneAt scene;
  const auto cursor = store_.messages(behavior_, range);
  while (auto message = cursor->next()) {
    if (placeOf(*message) >= next_) break;
    if (is_added_up) {
      scene.add(channelOf(message->channel), replay::Modality::Ar, std::move(*message));
    } else {
      messages.push_back(std::move(*message));
    }
  }
  return is_added_up ? scene.light({next_.first}) : messages;
}

void FoxglovePlayback::openReader() {
  reader_.reset();
  if (subscriptions_.empty()) return;
  replay::MessageRange range{{}, Stamp{next_.first}, {}};
  for (const auto& [topic, subscription] : subscriptions_) range.topics.push_back(topic);
  reader_ = std::make_unique<replay::Prefetch>(store_.messages(behavior_, range), kReadAhead);
}

/// Sends what is due. Returns when to come back.
FoxglovePlayback::SteadyPoint FoxglovePlayback::playOn() {
  while (true) {
    const bool was_stalled = std::exchange(is_stalled_, !frames().hasRoom());
    if (was_stalled != is_stalled_) settle();
    if (is_stalled_) return steady_clock::now() + kStall;
    if (is_paused_ || has_ended_ || !has_begun_) return SteadyPoint::max();
    const replay::Message* next = reader_ ? reader_->front() : nullptr;
    const SteadyTime now = steadyNow();
    const SteadyTime due = timeline_.deadline(next ? next->received : end_);
    if (now < due) {
      const Stamp time = timeline_.recorded(now);
      next_ = std::max(next_, Place{time.ns, 0});
      sendTime(time);
      return std::min(SteadyPoint(std::chrono::nanoseconds(due.ns)), steady_clock::now() + kTick);
    }
    if (!next) {
      sendTime(end_);
      next_ = {end_.ns, 0};
      has_ended_ = true;
      settle();
      tell();
      return SteadyPoint::max();
    }
    sendDue(reader_->pop());
  }
}

void FoxglovePlayback::sendDue(const replay::Message& message) {
  if (placeOf(message) < next_) return;  // of the stamp at which the reader was opened
  next_ = {message.received.ns, message.sequence + 1};
  const auto subscription = subscriptions_.find(channelOf(message.channel).topic);
  if (subscription == subscriptions_.end()) return;
  sendTime(message.received);
  send(message, subscription->second, message.received);
}

void FoxglovePlayback::send(const replay::Message& message, std::uint32_t subscription,
                            Stamp received) {
  const replay::Channel& channel = channelOf(message.channel);
  const auto topic = topics_.find(channel.topic);
  const bool is_as_announced = topic != topics_.end() && topic->second.channel.md5 == channel.md5 &&
                               topic->second.channel.type == channel.type;
  if (!is_as_announced) return;
  std::string frame = messageFrame(subscription, received, message.bytes.size());
  std::copy(message.bytes.begin(), message.bytes.end(),
            frame.begin() + static_cast<std::ptrdiff_t>(kMessageOffset));
  frames().push({false, std::move(frame)});
}

/// Never back, which would be a seek to tools that know of no others.
void FoxglovePlayback::sendTime(Stamp time) {
  if (time <= told_) return;
  told_ = time;
  frames().push(timeFrame(time));
}

void FoxglovePlayback::tell(bool has_sought, const std::string& id) {
  if (!has_controls_) return;
  using Status = PlaybackState::Status;
  const Status status = has_ended_ ? Status::Ended : is_paused_ ? Status::Paused : Status::Playing;
  frames().push(playbackStateFrame({status, {next_.first}, timeline_.rate(), has_sought, id}));
}

const replay::Channel& FoxglovePlayback::channelOf(std::int64_t id) {
  const auto known = channels_.find(id);
  return known != channels_.end() ? known->second
                                  : channels_.emplace(id, store_.channel(id)).first->second;
}

}  // namespace afterglow::nodes
