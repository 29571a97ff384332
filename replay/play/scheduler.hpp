/// \file
/// The scheduler: one loop that waits for deadlines and for requests, drives the base, and has the
/// other parts of the player act.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "replay/motion/base/base_drive.hpp"
#include "replay/play/body_in_force.hpp"
#include "replay/play/message_lanes.hpp"
#include "replay/play/outbox.hpp"
#include "replay/play/scene_at.hpp"
#include "replay/play/step_gate.hpp"
#include "replay/play/transport.hpp"
#include "replay/store/store.hpp"
#include "replay/store/store_reading.hpp"

namespace afterglow::replay {

/// Steps PlayOptions::base_drive; does nothing without one. For the thread that plays. Everything
/// given outlives it.
class DrivenBase {
 public:
  DrivenBase(const PlayContext& play, std::function<Stamp()> ros_now, Outbox& outbox,
             const StepGate& gate);

  /// The replay begins at this recorded moment, or goes on there.
  void enter(Stamp at);
  /// Sends the next command if one is due. A lost base is a failure of the body.
  void step();
  /// Returns when step() is due.
  SteadyTime nextStep() const { return drive_ ? next_step_ : SteadyTime::forever(); }
  /// The base is driven at this recorded moment, or has not arrived yet.
  bool isBusy(Stamp at) const { return drive_ && drive_->isBusy(at); }

 private:
  const PlayContext& play_;
  const std::function<Stamp()> ros_now_;
  Outbox& outbox_;
  const StepGate& gate_;
  BaseDrive* const drive_;
  SteadyTime next_step_;
};

/// The parts of a player, which outlive its scheduler.
struct PlayerParts {
  const Store& store;
  bool has_motion;
  std::function<Stamp()> ros_now;
  const GoalBook& goals;
  Outbox& outbox;
  ArmLead& lead;
  StepGate& gate;
  DrivenBase& base;
  BodyInForce& body;
};

/// Used once: play(), then finish(). One thread.
class Scheduler {
 public:
  Scheduler(const PlayContext& play, PlayerParts parts) : play_(play), parts_(std::move(parts)) {}

  /// Plays to the end, or a stop. Throws what ends a replay early.
  void play();
  /// However it ended: brings the robot to rest and clears the projection.
  void finish();
  /// The end was reached, and a stop was only awaited (PlayOptions::keeps_alive).
  bool hasEnded() const { return has_ended_; }

 private:
  struct Due {
    Message message;
    const Channel* channel = nullptr;
    OutboxTopic* topic = nullptr;
    SteadyTime deadline;
  };
  /// The reason why a wait is over.
  enum class Wake { Due, Moved, Stopped };

  bool playRound();
  void playDue();
  std::vector<Due> takeDue(SteadyTime now);
  void send(Due& due);
  void leapAfterStall(Stamp recorded);
  void leapTo(Stamp recorded);
  std::optional<Stamp> leapBefore(Stamp recorded) const;

  Wake waitUntil(Stamp recorded, std::int64_t early_ns);
  Wake waitFor(double seconds, const std::function<bool()>& is_over);
  SteadyTime nextStep() const;
  bool keepInStep();
  Wake followRequests();
  void pause();
  void resume();
  void setRate(double rate);
  bool step();

  void enter(Stamp at);
  void moveTo(Stamp to);
  SceneAt readScene(Stamp at);
  void show(const SceneAt& scene, Stamp at);
  Wake endRound();

  const PlayContext& play_;
  const PlayerParts parts_;
  std::unique_ptr<MessageLanes> lanes_;
  KnownChannels channels_{parts_.store};
  Stamp played_until_;     ///< the last message's, for gaps
  bool has_next_ = false;  ///< a message is to come
  bool has_ended_ = false;
};

}  // namespace afterglow::replay
