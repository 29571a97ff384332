/// \file
/// The goals of one action whose server is in ROS 1, as the services and topics of an action of
/// ROS 2: the other way round than action_relay.hpp, where the sources are. Internal to replay.
/// Source of the codes of a cancel, and of the time that a result is kept: rcl_action.
#pragma once

#include <functional>
#include <list>
#include <optional>
#include <string>
#include <vector>

#include "replay/ros2/action_messages.hpp"
#include "replay/ros2/action_type.hpp"

namespace afterglow::replay {

/// The server of an action for clients in ROS 2, and its client for the server in ROS 1. ROS 2 has
/// the status, feedback and results of other clients' goals, too. Input that is no message of the
/// action is told as a problem. Not for two threads at once.
class ActionRelayToRos2 {
 public:
  struct Outlets {
    /// Answers a request (CDR).
    std::function<void(ActionService, const RequestId&, const Bytes& cdr)> reply;
    /// Publishes status or feedback on ROS 2 (CDR).
    std::function<void(ActionTopic, const Bytes& cdr)> publish_on_ros2;
    /// Publishes a goal or a cancel on ROS 1 (ROS 1's bytes).
    std::function<void(ActionTopic, const Bytes& ros1)> publish_on_ros1;
    std::function<void(const std::string& problem)> tell;
    std::function<GoalUuid()> fresh_uuid;
  };

  ActionRelayToRos2(const ActionType& type, Outlets outlets);

  /// From ROS 2 (CDR).
  void onRequest(ActionService service, const RequestId& id, const Bytes& cdr, Stamp now);

  // From ROS 1: the server's topics.
  void onStatus(const Bytes& ros1, Stamp now);
  void onFeedback(const Bytes& ros1);
  void onResult(const Bytes& ros1, Stamp now);

  /// Ends all goals that have no end.
  void onServerGone(Stamp now);
  /// Cancels those of ROS 2, and ends all: nobody could cancel them any more.
  void onBridgeEnds(Stamp now);
  /// To be called kActionTicksPerSecond times.
  void tick(Stamp now);

  /// Whether the server has told its status lately, as actionlib's servers do all the time.
  bool isServerAlive() const { return silence_ <= kEndedTicks; }
  /// Whether a goal has no end yet.
  bool isBusy() const;

 private:
  struct Goal {
    GoalUuid uuid{};
    ActionGoalId id;  ///< in ROS 1
    GoalState state = GoalState::Pending;
    std::optional<RequestId> sent;         ///< its request, until that is answered
    std::vector<RequestId> asked;          ///< requests for its result, until there is one
    std::optional<Bytes> result;           ///< the answer to these; the goal has ended
    std::optional<GoalState> final_state;  ///< by the status; its result may still come
    Stamp accepted;
    bool is_ours = false;    ///< its client is in ROS 2
    bool is_listed = false;  ///< the server's status has had it
    int ticks = 0;           ///< since it was sent, final or ended
  };
  /// Waits until the server in ROS 1 has shown what it does about it.
  struct Cancel {
    RequestId id;
    std::vector<GoalUuid> goals;
    int ticks = 0;
  };

  /// Calls the handler; tells a MessageError of it with what was read. Returns whether there was
  /// none.
  template <typename Handler>
  bool guarded(const char* what, const Handler& handler);
  Goal* find(const GoalUuid& uuid);
  Goal* find(const std::string& id);
  void onGoal(const RequestId& id, const Bytes& cdr, Stamp now);
  void onResultRequest(const RequestId& id, const Bytes& cdr);
  void onCancel(const RequestId& id, const Bytes& cdr);
  void onGoalStatus(const ActionGoalStatus& told, Stamp now);
  void onGoalState(Goal& goal, GoalState state, Stamp now);
  void accept(Goal& goal, Stamp now);
  void reject(Goal& goal);
  void sendCancel(const ActionGoalId& cancel);
  void endGoal(Goal& goal, GoalState state, const Bytes& part);
  void endAll(Stamp now);
  void look(Goal& goal, Stamp now);
  void answerCancels();
  bool answer(const Cancel& cancel);
  void publishStatus();

  const ActionType type_;
  const Outlets outlets_;
  std::list<Goal> goals_;
  std::vector<Cancel> cancels_;
  Bytes status_;                   ///< as it was published last
  int silence_ = kEndedTicks + 1;  ///< ticks since the server's last status
};

}  // namespace afterglow::replay
