#include "nodes/guard/guarded_player.hpp"

#include <algorithm>

#include "nodes/guard/machine_name.hpp"

namespace afterglow {
namespace nodes {
namespace {

constexpr std::uint32_t kStopQueue = 10;
/// Nobody waits longer for a player that is somewhere else, whatever it asks for.
constexpr std::int64_t kMostPatienceAfar = 1000000000;
/// The time after which a player that did not say its farewell is forgotten.
constexpr std::int64_t kMemory = 60000000000;

class RosStopWay : public StopWay {
 public:
  explicit RosStopWay(const ros::Publisher& publisher) : publisher_(publisher) {}

  std::uint32_t heardBy() const override { return publisher_.getNumSubscribers(); }
  void publish(const StopMessage& stop) override {
    if (publisher_) publisher_.publish(stop);  // none: its type is another's
  }

 private:
  ros::Publisher publisher_;
};

}  // namespace

GuardedPlayer::Ways GuardedPlayer::advertise(ros::NodeHandle& node, const GuardOutputs& outputs,
                                             const Ways& known) {
  Ways ways;
  for (const GuardOutput& output : outputs.outputs) {
    const auto found = known.find(output.topic);
    if (found != known.end()) {
      ways.insert(*found);
    } else {
      ros::AdvertiseOptions options(output.topic, kStopQueue, output.md5sum, output.type,
                                    output.definition);
      ways[output.topic] = std::make_shared<RosStopWay>(node.advertise(options));
    }
  }
  return ways;
}

void GuardedPlayer::know(const GuardOutputs& outputs, const Ways& ways, replay::SteadyTime now) {
  id_ = outputs.player;
  name_ = outputs.name;
  is_beside_ = is_beside_ || (!outputs.machine.empty() && outputs.machine == machineName());
  version_ = outputs.version;
  ways_ = ways;
  last_heard_ = now;
  stops_.clear();
  for (const GuardOutput& output : outputs.outputs) {
    stops_.push_back(
        {output.topic, {output.type, output.md5sum, output.definition, output.stop}});
  }
}

void GuardedPlayer::hear(const GuardBeat& beat, replay::SteadyTime now) {
  id_ = beat.player;
  if (last_.count > 0) {
    longest_gap_ns_ = std::max(longest_gap_ns_, now.ns - last_heard_.ns);
  }
  last_ = beat;
  last_heard_ = now;
  for (const auto& stop : stops_) {
    if (ways_.at(stop.first)->heardBy() > 0) heard_.insert(stop.first);
  }
  patience_ns_ = static_cast<std::int64_t>(beat.patience_ms) * 1000000;
  if (!is_beside_) patience_ns_ = std::min(patience_ns_, kMostPatienceAfar);
  watch_.setLongestSilence(patience_ns_);
  if (beat.end != 0) {
    watch_.end();
  } else if (beat.stop != 0) {
    watch_.stop(now, "the player asked for it");
  } else {
    watch_.beat(now, replay::Outputs(beat.moving.begin(), beat.moving.end()),
                {static_cast<std::int64_t>(beat.sent_ns)});
    for (const auto& way : ways_) {
      const std::string objection = way.second->objection();
      if (!objection.empty()) watch_.stop(now, objection);
    }
  }
}

GuardAnswer GuardedPlayer::answer() const {
  GuardAnswer answer;
  answer.player = id_;
  answer.count = last_.count;
  answer.version = version_;
  answer.longest_gap_us = static_cast<std::uint32_t>(longest_gap_ns_ / 1000);
  answer.patience_ms = static_cast<std::uint32_t>(patience_ns_ / 1000000);
  answer.is_beside = is_beside_ ? 1 : 0;
  answer.stopped = watch_.reason();
  for (const auto& stop : stops_) {
    answer.heard_by.push_back(ways_.at(stop.first)->heardBy());
  }
  return answer;
}

bool GuardedPlayer::step(replay::SteadyTime now) {
  const replay::Outputs due = watch_.step(now);
  for (const std::uint32_t output : due) {
    if (output >= stops_.size()) continue;
    ways_.at(stops_[output].first)->publish(stops_[output].second);
  }
  if (due.empty() || !stopped_.empty()) return false;
  stopped_ = due;
  return true;
}

bool GuardedPlayer::isBraking() const { return !watch_.isOver() && !watch_.reason().empty(); }

/// Only what somebody heard before is missed: some stops are for controllers that need not be
/// there, and the player moves nothing that no controller hears.
std::string GuardedPlayer::account() const {
  std::string unheard;
  std::size_t heard = 0;
  for (const std::uint32_t output : stopped_) {
    if (output >= stops_.size()) continue;
    const std::string& topic = stops_[output].first;
    if (ways_.at(topic)->heardBy() > 0) {
      ++heard;
    } else if (heard_.count(topic) > 0) {
      unheard += " " + topic;
    }
  }
  return watch_.reason() + ": " +
         (heard > 0 ? "the robot is being stopped" : "the robot is NOT stopped") +
         (unheard.empty() ? "" : "; nobody hears the stop on" + unheard);
}

bool GuardedPlayer::isGone(replay::SteadyTime now) const {
  return !isBraking() && (last_.end != 0 || last_heard_.after(kMemory) <= now);
}

}  // namespace nodes
}  // namespace afterglow
