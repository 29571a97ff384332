/// \file
/// The player: one scheduler that sends a behavior's messages when they are due, rewritten to be
/// right now, and leaves the robot standing and the floor dark when it is done, however it ends.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "replay/play/clock.hpp"
#include "replay/play/goal_book.hpp"
#include "replay/play/play_plan.hpp"
#include "replay/play/play_report.hpp"
#include "replay/play/prefetch.hpp"
#include "replay/play/rewrite.hpp"
#include "replay/play/timeline.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// Where messages go.
class MessageSink {
 public:
  virtual ~MessageSink() = default;
  /// True if somebody listens on the topic. May throw: the message counts as refused.
  virtual bool publish(const Channel& channel, const Bytes& bytes) = 0;
};

struct PlayOptions {
  double rate = 1.0;  ///< for light and speech; the caller keeps the body at 1
  bool clear_projection = true;
  double hold_s = 2.0;        ///< how long the light stays after the end before it is cleared
  double goal_wait_s = 10.0;  ///< how long goals may take beyond the behavior's end
  std::size_t prefetch_bytes = 64u << 20;
};

struct PlayProgress {
  enum class State { Idle, Playing, Paused } state = State::Idle;
  PlaybackTime position;
  std::uint64_t published = 0;
};

/// One replay. Deadlines are absolute; order is receive stamp, then sequence. What is late:
/// - by 2 ms and overtaken by the next of its topic: skipped, for velocities, goals and types of
///   which a message replaces the one before (clouds, scans, paths); markers are always sent;
/// - a velocity by 250 ms: skipped, the base has stopped by itself; never a zero one;
/// - any other motion by 1 s: the replay stops. Motion is never sent in a burst.
/// Velocities that are no numbers are never sent.
/// A pause sends zero velocities and cancels the goals under way; resuming sends what is left of
/// them. The end: a normal one waits for the goals under way, up to a bound. Then, and after
/// stop(), an error or a stall: goals that are still open are canceled, every velocity topic that
/// was played gets a zero, and projected topics are cleared.
class Player {
 public:
  /// Everything must outlive the player. `ros_now` gives ROS time, `ids` fresh goal ids.
  Player(const Store& store, const PlayPlan& plan, const PlayOptions& options, MessageSink& sink,
         Clock& clock, std::function<Stamp()> ros_now, Rewriter::FreshId ids);
  ~Player();
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;

  /// Plays; returns when all is over, cleaned up. The calling thread is the scheduler. Once.
  PlayReport run();

  // Any thread, also before run().
  void stop(const std::string& reason);
  void pause();
  void resume();
  /// A goal's status, seen on its action server's status topic; ids that are not ours are ignored.
  void onGoalStatus(const std::string& id, std::uint8_t goal_status);
  PlayProgress progress() const;

 private:
  struct Topic {
    const PlannedTopic* planned = nullptr;
    bool is_velocity = false, is_replacing = false;
    bool has_moved = false;  ///< a velocity was sent
    TopicReport report;
    Bytes last;  ///< projected content in force
  };
  struct Due {
    Message message;
    const Channel* channel = nullptr;
    Topic* topic = nullptr;
    SteadyTime deadline;
  };

  void play();
  Prefetch& startReading();
  void startTimeline();
  void measureLength();
  void playDue(Prefetch& prefetch);
  void send(Due& due);
  bool isOvertaken(const std::vector<Due>& batch, std::size_t index, SteadyTime now) const;
  bool isTooLate(const Due& due, std::int64_t late_ns) const;
  PublishMoment momentOf(Stamp received, std::int64_t late_ns);
  void publish(Topic& topic, const Channel& channel, Stamp received, Bytes bytes,
               std::int64_t late_ns);

  bool waitUntil(Stamp recorded);
  bool waitFor(double seconds, const std::function<bool()>& is_over);
  bool followRequests();
  void suspend();
  void proceed();
  void waitForGoals();
  void finish();
  void sendZeroVelocities();
  void sendCancels(const std::vector<GoalBook::Entry>& goals);
  void clearProjection();
  void trySend(const Channel& channel, const Bytes& bytes);
  void note(const std::string& problem);
  Topic* topicOf(const Channel& channel);
  const Channel& channelOf(std::int64_t id);
  bool isStopped() const;

  const Store& store_;
  const PlayPlan& plan_;
  const PlayOptions options_;
  MessageSink& sink_;
  Clock& clock_;
  const std::function<Stamp()> ros_now_;
  Rewriter rewriter_;
  GoalBook goals_;

  // The scheduler's.
  std::map<std::string, Topic> topics_;
  std::map<std::int64_t, Channel> channels_;
  std::optional<std::int64_t> shift_ns_;  ///< what recorded stamps are moved by
  PlayReport report_;

  mutable std::mutex mutex_;
  std::optional<Timeline> timeline_;  ///< changed by the scheduler only
  std::unique_ptr<Prefetch> prefetch_;
  std::optional<std::string> stop_reason_;
  bool is_pause_wanted_ = false;
  std::uint64_t published_ = 0;
};

}  // namespace afterglow::replay
