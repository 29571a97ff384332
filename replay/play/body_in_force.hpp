/// \file
/// The goals, trajectory commands and velocities that are in force: suspended for a pause, sent
/// again after it, halted and canceled at the end.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "replay/motion/goal_book.hpp"
#include "replay/motion/milestones.hpp"
#include "replay/play/outbox.hpp"
#include "replay/play/step_gate.hpp"
#include "replay/play/transport.hpp"

namespace afterglow::replay {

/// The GoalBook has the goals, this class the commands. For the thread that plays. Everything given
/// outlives it.
class BodyInForce {
 public:
  BodyInForce(const PlayContext& play, const Milestones& milestones, GoalBook& goals,
              Outbox& outbox, ArmLead& lead, const StepGate& gate)
      : play_(play),
        milestones_(milestones),
        goals_(goals),
        outbox_(outbox),
        lead_(lead),
        gate_(gate) {}

  /// Publishes a message. A command or goal is in force from then on; a recorded cancel ends its
  /// goal.
  void send(Outbox::Outgoing message);
  /// Follows the goals that have ended. One that failed, or was canceled by somebody else, is a
  /// failure of its modality. Returns the last one that the timeline waited for.
  std::optional<GoalBook::Ended> followEnds();

  /// Cancels the goals that were canceled in the recording until now, by whatever was not recorded.
  void cancelDue();
  /// Returns when cancelDue() has to be called next.
  SteadyTime nextCancel() const;

  /// Stops for a pause: zero velocities, halts and cancels are sent; proceed() sends the rest.
  void suspend(SteadyTime now);
  /// Stops for another rate: proceed() and cancelOvertaken() are to follow at once. The goals are
  /// canceled here, or there where controllers join the next one: after a cancel they step back to
  /// what is measured, as far as the motors lag.
  void suspendGoals();
  /// Goals that the rest has overtaken, or that run on where none was sent.
  void cancelOvertaken();
  /// Stops for another place: zero velocities and halts are sent, the goals given up.
  void abandon();
  /// The targets in force where the replay goes on: suspended, and proceed() gives them a lead.
  void setTargets(const std::vector<std::pair<Channel, Message>>& targets);
  /// Sends the rest of suspended goals and trajectories, and the velocities in force.
  void proceed();
  /// Sends the velocities in force at a recorded moment.
  void sendVelocities(Stamp at);

  enum class Halts { All, Targets };
  /// Halts what follows a trajectory command, and what goes to a target until it is canceled; or
  /// only the latter, which does not end by itself.
  void haltCommands(Halts which = Halts::All);
  /// Cancels all goals that are open or suspended.
  void giveUpGoals();

 private:
  /// A command as it was recorded, of which it may be only the rest that is sent.
  struct Recorded {
    Bytes bytes;
    Stamp at;
  };
  std::optional<Outbox::Sent> sendAs(Outbox::Outgoing message, Recorded whole);
  void noteCanceled(const std::string& id, const std::vector<GoalBook::Entry>& open);
  void sendRest(OutboxTopic& topic, const Channel& channel, const Recorded& whole,
                std::int64_t lead_ns);
  void sendVelocity(OutboxTopic& topic, const Recorded& command, Stamp at);
  void sendCancels(const std::vector<GoalBook::Entry>& goals);
  void holdGaze(const std::vector<GoalBook::Entry>& goals);
  void addGoal(const std::string& output, GoalBook::Entry entry);
  bool repeatHeadGoal(const GoalBook::Ended& ended);
  void followEnd(const GoalBook::Ended& ended);
  double leadToProceed(const std::vector<GoalBook::Entry>& goals, Stamp at);
  std::optional<RestNeed> needOf(const Channel& channel, const Recorded& whole, Stamp at);

  const PlayContext& play_;
  const Milestones& milestones_;
  GoalBook& goals_;
  Outbox& outbox_;
  ArmLead& lead_;
  const StepGate& gate_;
  std::vector<GoalBook::Entry> overtaken_;  ///< suspended by suspendGoals(), to be canceled
  /// Velocities and trajectory commands, by recorded topic.
  std::map<std::string, Recorded> commands_;
  std::map<std::pair<std::string, std::int64_t>, int> head_repeats_;  ///< repeats by goal
};

}  // namespace afterglow::replay
