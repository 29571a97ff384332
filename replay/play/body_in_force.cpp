#include "replay/play/body_in_force.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "replay/messages/topic_name.hpp"
#include "replay/motion/goal_remainder.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::replay {
namespace {

constexpr int kMostHeadRepeats = 3;
constexpr double kSlowHead = 0.25;  // rad/s, for a head whose joints nobody knows

/// "<action>/goal" for "<action>/cancel"; empty for every other topic.
std::string goalOfCancel(const Channel& channel) {
  return isCancel(channel) ? actionOf(channel.topic) + "/goal" : "";
}

}  // namespace

// ----------------------------------------------------------------------------------------- sending

void BodyInForce::send(Outbox::Outgoing message) {
  Recorded whole{message.topic.is_command ? message.bytes : Bytes(), message.recorded};
  const auto open = goals_.openOn(goalOfCancel(message.channel));
  const auto sent = sendAs(std::move(message), std::move(whole));
  if (sent && !sent->canceled.empty()) noteCanceled(sent->canceled, open);
}

/// Notes that a goal was canceled as it had been: nothing waits for it any more.
void BodyInForce::noteCanceled(const std::string& id, const std::vector<GoalBook::Entry>& open) {
  for (const GoalBook::Entry& goal : open) {
    if (goal.id != id) continue;
    goals_.cancel(outbox_.topic(goal.channel.topic).planned.output.topic, id);
    play_.ledger.endGoal({goal, GoalOutcome::Canceled, play_.clock.now()});
    holdGaze({goal});
  }
}

/// Empty if it was not sent.
std::optional<Outbox::Sent> BodyInForce::sendAs(Outbox::Outgoing message, Recorded whole) {
  const Channel& channel = message.channel;
  const OutboxTopic& topic = message.topic;
  const auto sent = outbox_.publish(std::move(message));
  if (sent && !sent->goal) {
    if (topic.is_command) commands_[topic.planned.channel.topic] = std::move(whole);
  } else if (sent && sent->was_heard) {
    addGoal(topic.planned.output.topic, {channel, std::move(whole.bytes), whole.at, *sent->goal});
  }
  return sent;
}

void BodyInForce::addGoal(const std::string& output, GoalBook::Entry entry) {
  entry.sent_at = play_.clock.now();
  const auto end = milestones_.of(entry.channel.topic, entry.recorded_at);
  if (end && end->at > play_.timeline().recorded(entry.sent_at)) entry.milestone = end;
  play_.ledger.addGoal(entry, end);
  goals_.add(output, std::move(entry));
}

void BodyInForce::sendRest(OutboxTopic& topic, const Channel& channel, const Recorded& whole,
                           std::int64_t lead_ns) {
  const Stamp at = play_.timeline().recorded(play_.clock.now());
  bool was_sent = false;
  try {
    // Where joints are looked at, the rest begins where they are on its path.
    const bool has_joints = isTrajectoryCommand(channel) || isGoal(channel);
    const bool is_looked_at = lead_.arm() && has_joints && topic.planned.modality == Modality::Body;
    Bytes rest = is_looked_at ? whole.bytes
                              : remainderOfGoal(channel, whole.bytes, at.ns - whole.at.ns, lead_ns);
    if (isHeadGoal(channel)) {
      const double fastest = lead_.arm() ? lead_.arm()->headVelocity(whole.at, at) : kSlowHead;
      rest = noFaster(channel, rest, fastest);
    }
    was_sent = sendAs({topic, channel, at, whole.at, std::move(rest)}, whole).has_value();
  } catch (const MessageError& error) {
    topic.report.problem = error.what();
  }
  if (!was_sent && !play_.transport.isStopped()) {
    play_.ledger.note("the rest of a motion on " + channel.topic +
                 " was not sent: " + topic.report.problem);
  }
}

void BodyInForce::sendVelocity(OutboxTopic& topic, const Recorded& command, Stamp at) {
  const bool holds = !topic.times_out || at.ns - command.at.ns < kVelocityHoldsNs;
  if (holds && !topic.stop.isNeutral(command.bytes)) {
    sendAs({topic, topic.planned.channel, at, command.at, command.bytes}, command);
  }
}

void BodyInForce::sendVelocities(Stamp at) {
  for (auto& [name, topic] : outbox_.topics()) {
    const auto command = commands_.find(name);
    if (topic.is_velocity && command != commands_.end()) {
      sendVelocity(topic, Recorded(command->second), at);
    }
  }
}

// --------------------------------------------------------------------------------- how goals ended

std::optional<GoalBook::Ended> BodyInForce::followEnds() {
  std::optional<GoalBook::Ended> reached;
  for (const GoalBook::Ended& ended : goals_.takeEnded()) {
    if (repeatHeadGoal(ended)) continue;
    followEnd(ended);
    const bool is_reached = gate_.isWaitedFor(ended.milestone);
    if (is_reached && (!reached || reached->milestone->at < ended.milestone->at)) reached = ended;
  }
  return reached;
}

/// Fetch's head controller may take a goal for reached because the goal before it was: a goal that
/// ended long before its shortest duration is sent again.
bool BodyInForce::repeatHeadGoal(const GoalBook::Ended& ended) {
  if (play_.options.gaze_frame.empty() || !isHeadGoal(ended.channel) ||
      ended.outcome != GoalOutcome::Succeeded) {
    return false;
  }
  const double planned = static_cast<double>(shortestDurationNs(ended.channel, ended.recorded)) /
                         play_.timeline().rate();
  const bool was_done = static_cast<double>(ended.at.ns - ended.sent_at.ns) > planned / 2;
  int& repeats = head_repeats_[{ended.channel.topic, ended.recorded_at.ns}];
  if (was_done || repeats == kMostHeadRepeats) {
    return false;
  }
  ++repeats;
  sendRest(outbox_.topic(ended.channel.topic), ended.channel, {ended.recorded, ended.recorded_at},
           0);
  return true;
}

void BodyInForce::followEnd(const GoalBook::Ended& ended) {
  play_.ledger.endGoal(ended);
  const std::string& topic = ended.channel.topic;
  const auto recorded = milestones_.of(topic, ended.recorded_at);
  const bool failed_then = recorded && recorded->outcome != GoalOutcome::Succeeded;
  // The player's own cancels do not come here: somebody else stopped the body.
  const bool was_canceled = ended.outcome == GoalOutcome::Canceled && gate_.isGated() &&
                            ended.milestone && ended.milestone->is_awaited;
  if ((ended.outcome == GoalOutcome::Failed && !failed_then) || was_canceled) {
    const Modality modality = outbox_.topic(topic).planned.modality;  // sound_play's is speech
    play_.transport.fail(modality,
                    "a goal on " + topic + " " + (was_canceled ? "was canceled" : ended.how) +
                        (recorded ? ", and was not when it was recorded" : ""));
  }
}

void BodyInForce::cancelDue() {
  while (const auto at = goals_.nextCanceled()) {
    if (play_.clock.now() < play_.timeline().deadline(*at)) return;
    const std::vector<GoalBook::Entry> goals = goals_.giveUpCanceled(*at);
    sendCancels(goals);
    holdGaze(goals);
    for (const GoalBook::Entry& goal : goals) {
      play_.ledger.endGoal({goal, GoalOutcome::Canceled, play_.clock.now()});
    }
  }
}

SteadyTime BodyInForce::nextCancel() const {
  const std::optional<Stamp> at = goals_.nextCanceled();
  return at ? play_.timeline().deadline(*at) : SteadyTime::forever();
}

// ---------------------------------------------------------------------------- standing, going on

void BodyInForce::suspend(SteadyTime now) {
  outbox_.sendZeroVelocities();
  haltCommands();
  const std::vector<GoalBook::Entry> goals = goals_.suspendOpen();
  sendCancels(goals);
  holdGaze(goals);
  lead_.halt(now);
}

void BodyInForce::suspendGoals() {
  lead_.lookAtHalted();
  overtaken_ = goals_.suspendOpen();
  if (!lead_.arm() || !lead_.arm()->controllersJoin()) cancelOvertaken();
}

void BodyInForce::cancelOvertaken() { sendCancels(std::exchange(overtaken_, {})); }

void BodyInForce::abandon() {
  outbox_.sendZeroVelocities();
  haltCommands();
  giveUpGoals();
  lead_.forget();
}

void BodyInForce::haltCommands(Halts which) {
  for (const auto& [name, command] : commands_) {
    const OutboxTopic& topic = outbox_.topic(name);
    const bool is_target = topic.stop.stop().kind == StopKind::Cancel;
    if (!topic.is_velocity && (is_target || which == Halts::All)) {
      outbox_.send(topic.stop.channel(), topic.stop.after(command.bytes));
    }
  }
}

void BodyInForce::giveUpGoals() {
  for (const GoalBook::Ended& ended : goals_.takeEnded()) followEnd(ended);
  sendCancels(goals_.giveUp());
  play_.ledger.cancelGoals();
}

void BodyInForce::sendCancels(const std::vector<GoalBook::Entry>& goals) {
  for (const GoalBook::Entry& goal : goals) {
    const OutboxTopic& topic = outbox_.topic(goal.channel.topic);
    if (topic.stop.hasMessage()) outbox_.send(topic.stop.channel(), cancelMessage(goal.id));
    goals_.cancel(topic.planned.output.topic, goal.id);
  }
}

void BodyInForce::holdGaze(const std::vector<GoalBook::Entry>& goals) {
  const std::string& gaze_frame = play_.options.gaze_frame;
  for (const GoalBook::Entry& goal : goals) {
    if (gaze_frame.empty() || !isHeadGoal(goal.channel)) continue;
    outbox_.send(outbox_.topic(goal.channel.topic).planned.output,
                 presentGaze(goal.channel, goal.recorded, gaze_frame, goal.id + "-gaze"));
  }
}

void BodyInForce::setTargets(const std::vector<std::pair<Channel, Message>>& targets) {
  commands_.clear();
  const Stamp at = play_.timeline().recorded(play_.clock.now());
  for (const auto& [channel, message] : targets) {
    const auto end = milestones_.of(channel.topic, message.received);
    if (end && end->outcome == GoalOutcome::Canceled && end->at <= at) continue;
    if (isGoal(channel)) {
      goals_.suspend({channel, message.bytes, message.received, ""});
    } else {
      commands_[channel.topic] = {message.bytes, message.received};
    }
  }
  lead_.expectElsewhere();
}

void BodyInForce::proceed() {
  outbox_.forgetShift();
  if (lead_.nextLook() < SteadyTime::forever()) lead_.lookAtHalted();
  const Stamp at = play_.timeline().recorded(play_.clock.now());
  const std::vector<GoalBook::Entry> goals = goals_.takeSuspended();
  try {
    lead_.give(leadToProceed(goals, at), at);
  } catch (const ArmElsewhere& error) {
    play_.transport.stop(std::string("it does not go on: ") + error.what());
  }
  const std::int64_t lead_ns = std::llround(lead_.left_s() * 1e9 * play_.timeline().rate());
  for (const GoalBook::Entry& goal : goals) {
    if (play_.transport.isStopped()) return;
    sendRest(outbox_.topic(goal.channel.topic), goal.channel, {goal.recorded, goal.recorded_at},
             lead_ns);
  }
  for (auto& [name, topic] : outbox_.topics()) {
    const auto command = commands_.find(name);
    if (command == commands_.end()) {
      continue;
    }
    if (play_.transport.isStopped()) return;
    const Recorded whole = command->second;
    if (!topic.is_velocity) {
      sendRest(topic, topic.planned.channel, whole, lead_ns);
    } else if (!gate_.isHeldByGoal() && !lead_.isGiven()) {  // in a lead all stands
      sendVelocity(topic, whole, at);
    }
  }
}

/// The time that the slowest of them needs to get to where it goes on; 0: it goes on at once.
double BodyInForce::leadToProceed(const std::vector<GoalBook::Entry>& goals, Stamp at) {
  std::vector<std::optional<RestNeed>> needed;
  for (const GoalBook::Entry& goal : goals) {
    needed.push_back(needOf(goal.channel, {goal.recorded, goal.recorded_at}, at));
  }
  for (const auto& [name, command] : commands_) {
    const OutboxTopic& topic = outbox_.topic(name);
    if (!topic.is_velocity) needed.push_back(needOf(topic.planned.channel, command, at));
  }
  return lead_.leadFor(needed);
}

/// Empty if it is not known where the motion finds its joints.
std::optional<RestNeed> BodyInForce::needOf(const Channel& channel, const Recorded& whole,
                                            Stamp at) {
  const ArmStart* arm = lead_.arm();
  if (!arm) return std::nullopt;
  try {
    Bytes bytes = whole.bytes;
    outbox_.topic(channel.topic).scaling.apply(bytes, play_.timeline().rate());
    if (at > whole.at) return arm->needToGoOn(channel, bytes, lead_.progress(whole.at, at));
    const std::optional<double> lead_s = arm->leadOf(channel, bytes, at);
    return lead_s ? std::optional(RestNeed{*lead_s, *lead_s > 0}) : std::nullopt;
  } catch (const MessageError&) {
    return RestNeed{};  // nor can it be sent
  }
}

}  // namespace afterglow::replay
