/// \file
/// What the body has been told to do and still does: goals under way, trajectory commands,
/// velocities. Suspended for a pause, and told again when it is over.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "replay/clock/clock.hpp"
#include "replay/motion/goal_book.hpp"
#include "replay/motion/milestones.hpp"
#include "replay/play/arm_lead.hpp"
#include "replay/play/ledger.hpp"
#include "replay/play/outbox.hpp"
#include "replay/play/step_gate.hpp"
#include "replay/play/transport.hpp"

namespace afterglow::replay {

/// Goals are in the GoalBook, commands here. The thread that plays. Everything given outlives it.
class BodyInForce {
 public:
  BodyInForce(const PlayOptions& options, const Milestones& milestones, Clock& clock,
              Transport& transport, Outbox& outbox, ArmLead& lead, const StepGate& gate,
              GoalBook& goals, Ledger& ledger)
      : options_(options),
        milestones_(milestones),
        clock_(clock),
        transport_(transport),
        outbox_(outbox),
        lead_(lead),
        gate_(gate),
        goals_(goals),
        ledger_(ledger) {}

  /// A message that is due: sent, and a command or goal is in force from now on.
  void send(Outbox::Outgoing message);
  /// Writes down which goals have ended; one that failed, or was canceled by somebody else, is a
  /// failure of its modality. Returns the last one that the timeline stands for.
  std::optional<GoalBook::Ended> followEnds();

  /// For a pause, or another rate: what is in force is set aside until proceed().
  void suspend(SteadyTime now);
  /// Cancels the goals alone: what is sent in their place comes at once.
  void suspendGoals();
  /// Nothing that was in force will be any more: it stands and its goals are given up.
  void abandon();
  /// These were in force where the replay goes on: as if suspended, with time to get there.
  void setTargets(std::vector<std::pair<Channel, Message>> targets);
  /// Sends what is in force now: the rest of goals and trajectories, velocities.
  void proceed();
  /// The velocities that are in force at a recorded moment.
  void sendVelocities(Stamp at);

  /// Halts the joints that follow a trajectory command.
  void haltCommands();
  /// Cancels all goals that are open or suspended.
  void giveUpGoals();

 private:
  /// A command as it was recorded, of which it may be only the rest that is sent.
  struct Recorded {
    Bytes bytes;
    Stamp at;
  };
  bool sendAs(Outbox::Outgoing message, Recorded whole);
  void sendRest(OutboxTopic& topic, const Channel& channel, const Recorded& whole,
                std::int64_t lead_ns);
  void sendVelocity(OutboxTopic& topic, const Recorded& command, Stamp at);
  void sendCancels(const std::vector<GoalBook::Entry>& goals);
  void holdGaze(const std::vector<GoalBook::Entry>& goals);
  void addGoal(const std::string& output, GoalBook::Entry entry);
  bool repeatHeadGoal(const GoalBook::Ended& ended);
  void followEnd(const GoalBook::Ended& ended);
  double leadToProceed(const std::vector<GoalBook::Entry>& goals, Stamp at);
  std::optional<double> leadOf(const Channel& channel, const Recorded& whole, Stamp at);

  const PlayOptions& options_;
  const Milestones& milestones_;
  Clock& clock_;
  Transport& transport_;
  Outbox& outbox_;
  ArmLead& lead_;
  const StepGate& gate_;
  GoalBook& goals_;
  Ledger& ledger_;
  /// Velocities and trajectory commands, by recorded topic.
  std::map<std::string, Recorded> commands_;
  std::map<std::pair<std::string, std::int64_t>, int> head_repeats_;  ///< of goals
};

}  // namespace afterglow::replay
