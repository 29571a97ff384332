/// \file
/// A message's way to its publisher, in the order of outbox.cpp.
///
/// The lead: time for joints to go where their trajectories go on. The timeline stands meanwhile.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "replay/messages/message.hpp"
#include "replay/motion/arm/arm_start.hpp"
#include "replay/motion/motion_rate.hpp"
#include "replay/motion/stops/stop_maker.hpp"
#include "replay/plan/anchoring.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/plan/rewrite.hpp"
#include "replay/play/transport.hpp"

namespace afterglow::replay {

/// Leads of the arm; without PlayOptions::arm_start the live joints are not known, and after a seek
/// they get a lead all the same. For the thread that plays. Everything given outlives it.
class ArmLead {
 public:
  explicit ArmLead(const PlayContext& play) : play_(play) {}

  /// Returns the live joints; null where they are not known.
  ArmStart* arm() const { return play_.options.arm_start; }
  /// Returns how far a goal that was recorded at `begun` has come at `at`.
  GoalProgress progress(Stamp begun, Stamp at) const;
  /// The motions that go on next may find their joints elsewhere.
  void expectElsewhere() { is_elsewhere_expected_ = true; }
  /// The same, if the joints are still on their way in a lead.
  void expectElsewhereIfGiven() { is_elsewhere_expected_ |= isGiven(); }
  /// The lead for motions with these needs. If joints may be elsewhere, PlayOptions::seek_lead_s at
  /// least for those that are, or of which nothing is known (empty). Ends the expectation.
  double leadFor(const std::vector<std::optional<RestNeed>>& needs);
  /// The timeline stands at `at` for so long; 0: it goes on.
  void give(double seconds, Stamp at);
  bool isGiven() const { return play_.clock.now() < end_; }
  double left_s() const;  ///< the rest of the lead

  /// The joints are halted now; they are looked at when they have come to rest.
  void halt(SteadyTime now) { look_ = now.after(kHaltNs); }
  /// Notes where the halted joints stand.
  void lookAtHalted();
  /// Returns when to call lookAtHalted(); SteadyTime::forever(): not at all.
  SteadyTime nextLook() const { return look_; }
  /// The replay goes on at another recorded moment.
  void forget();

 private:
  static constexpr std::int64_t kHaltNs = 500'000'000;  ///< an arm takes so long to stand

  const PlayContext& play_;
  bool is_elsewhere_expected_ = false;
  SteadyTime end_;
  SteadyTime look_ = SteadyTime::forever();
};

/// Returns the message that clears a topic of projected content, as rviz's displays take it: it
/// empties PointCloud2 (keeps its fields), LaserScan, Path, Marker and MarkerArray; empty for every
/// other type, and for a `last` message that does not fit its definition. `last` gives the frame.
/// Stamps are left at 0, "whenever".
std::optional<Bytes> clearingMessage(const Channel& channel, const Bytes& last);

/// A receiver of messages.
class MessageSink {
 public:
  virtual ~MessageSink() = default;
  /// True if somebody listens on the topic. May throw: the message counts as refused. Latched
  /// messages of several `channel.caller_id`s hold beside each other, as those of several nodes do.
  virtual bool publish(const Channel& channel, const Bytes& bytes) = 0;
};

/// A topic that is played.
struct OutboxTopic {
  explicit OutboxTopic(const PlannedTopic& topic, const PlayOptions& options, TopicReport& counts);

  /// The connection that a recorded one is sent on: each latched publisher its own, as in rosbag
  /// play; plain ones share one.
  const Channel& outputOf(const Channel& recorded);

  const PlannedTopic& planned;
  TopicReport& report;
  MotionRate scaling;
  StopMaker stop;
  std::optional<Schema> numbers;  ///< schema of motion: only finite numbers are sent
  bool is_velocity;   ///< a velocity or another set point: it holds until the next one
  bool times_out;     ///< a velocity that a base obeys for kVelocityHoldsNs
  bool is_command;    ///< a set point, a trajectory command, a goal, a target that a cancel stops
  bool is_replacing;  ///< a message replaces the one before it
  bool is_driven;     ///< the base drive's
  double latency_s = 0;
  Bytes moved_by;          ///< the last set point sent; none: none was
  Bytes last;              ///< projected content in force
  std::vector<Channel> outputs;  ///< channels that were sent on
};

/// Rewrites messages to be right now, publishes and counts them. Knows which topics it has lit and
/// moved, and clears and stops them. For the thread that plays. Everything given outlives it.
class Outbox {
 public:
  /// Throws MessageError for a definition that is none.
  Outbox(const PlayContext& play, ArmLead& lead, MessageSink& sink,
         std::function<Stamp()> ros_now, Rewriter::FreshId ids);

  /// The topics by their recorded names.
  std::map<std::string, OutboxTopic>& topics() { return topics_; }
  OutboxTopic& topic(const std::string& name) { return topics_.at(name); }
  /// The same; none if it is not played.
  OutboxTopic* find(const std::string& name);

  struct Outgoing {
    OutboxTopic& topic;
    const Channel& channel;
    Stamp at;        ///< the moment of the recording that it is sent for
    Stamp recorded;  ///< stamp of the recording: before `at` for a motion that goes on
    Bytes bytes;     ///< the whole of a motion that goes on, where the joints are known
    std::int64_t late_ns = 0;
    SteadyTime released = {};  ///< until when it waited for the body: this is not lateness
    std::optional<PublishMoment> moment = {};  ///< empty: now, less the lateness
  };
  struct Sent {
    bool was_heard = false;
    std::optional<std::string> goal;
    std::string canceled = {};  ///< Rewritten::canceled
  };
  /// True for a message that must not be sent: it is too late, or its topic is the base drive's.
  /// Counted. Throws std::runtime_error if motion comes so late that the replay has to stop.
  bool leavesOut(const Outgoing& message) const;
  /// Empty if the message was not sent: it was refused, or is the cancel of a goal that was not
  /// sent. A refused message is counted and is a failure of light and speech; one whose arm is
  /// elsewhere stops the replay.
  std::optional<Sent> publish(Outgoing message);
  /// The timeline was moved: stamps are shifted anew from the next message on.
  void forgetShift() { shift_ns_.reset(); }
  /// Returns how many were published. Any thread.
  std::uint64_t published() const { return published_; }

  /// The base drive's command. Throws what the sink throws.
  void sendDriven(const Bytes& velocity);
  /// Sends a message as it is, without counting it; a failure is noted.
  void send(const Channel& channel, const Bytes& bytes);
  /// Sends zeros on every velocity topic that has moved the base; the base drive rests.
  void sendZeroVelocities();
  /// The same without the base drive, which stands by itself.
  void standStill();
  bool isLit() const;
  void clearProjection();
  /// The longest latency of its topics.
  double latency() const;
  /// PlannedTopic::rewrites with their counts.
  std::vector<RewrittenField> rewrites(const Channel& channel) { return rewriter_.rules(channel); }

 private:
  std::optional<Sent> tryPublish(Outgoing& message);
  PublishMoment momentOf(const Outgoing& message);
  void beginWhereJointsAre(Outgoing& message);
  void refuse(const Outgoing& message, const std::string& why);
  void sendZeroVelocity(const OutboxTopic& topic);

  const PlayContext& play_;
  ArmLead& lead_;
  MessageSink& sink_;
  const std::function<Stamp()> ros_now_;
  Rewriter rewriter_;
  std::map<std::string, OutboxTopic> topics_;
  std::optional<std::int64_t> shift_ns_;  ///< difference by which recorded stamps are moved
  std::atomic<std::uint64_t> published_{0};
};

}  // namespace afterglow::replay
