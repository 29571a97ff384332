/// \file
/// The goals of one action whose server is in ROS 2, as actionlib's five topics. Internal to
/// replay. Sources of the semantics: actionlib's ActionServer (a goal whose id is known is ignored;
/// a cancel names one goal, all up to a stamp, or all; one may come before its goal) and
/// design.ros2.org/articles/actions.html.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <list>
#include <optional>
#include <string>
#include <vector>

#include "replay/ros2/action_messages.hpp"
#include "replay/ros2/action_type.hpp"

namespace afterglow::replay {

/// The server of an action for clients in ROS 1, and its client for the server in ROS 2; tells ROS
/// 1 the goals and cancels of other clients in ROS 2, too. Asks the server for the result of every
/// goal. Input that is no message of the action is told as a problem. Not for two threads at once.
class ActionRelay {
 public:
  struct Outlets {
    /// Sends a request (CDR) to the server; its reply comes to onReply(), not before this returns.
    std::function<RequestId(ActionService, const Bytes& cdr)> request;
    /// Publishes a message (ROS 1's bytes); it must not come back to onRos1Goal(), onRos1Cancel().
    std::function<void(ActionTopic, const Bytes& ros1)> publish;
    std::function<void(const std::string& problem)> tell;
    std::function<GoalUuid()> fresh_uuid;
  };

  ActionRelay(const ActionType& type, Outlets outlets);

  // From ROS 1: its clients' goals and cancels.
  void onRos1Goal(const Bytes& ros1, Stamp now);
  void onRos1Cancel(const Bytes& ros1);

  // From ROS 2 (CDR): requests and replies whoever they are of; the server's topics.
  void onRequest(ActionService service, const RequestId& id, const Bytes& cdr, Stamp now);
  void onReply(ActionService service, const RequestId& request, const Bytes& cdr, Stamp now);
  void onFeedback(const Bytes& cdr, Stamp now);
  void onStatus(const Bytes& cdr, Stamp now);

  /// Ends all goals that have no end.
  void onServerGone(Stamp now);
  /// Cancels and ends those of ROS 1: nobody could cancel them any more.
  void onBridgeEnds(Stamp now);

  /// Publishes the status as actionlib's servers do; to be called kActionTicksPerSecond times.
  void tick(Stamp now);

 private:
  struct Goal {
    GoalUuid uuid{};
    ActionGoalStatus status;
    RequestId sent;                  ///< request of the goal
    std::optional<RequestId> asked;  ///< request of its result, once it is accepted
    /// Told by the server; ROS 1 gets it with the result, as actionlib's servers tell it.
    std::optional<GoalState> final_state;
    bool is_ours = false;       ///< its client is in ROS 1
    bool is_shown = false;      ///< ROS 1 has its goal message
    bool is_to_cancel = false;  ///< once it is accepted
    bool has_ended = false;     ///< ROS 1 has its result
    int ticks = 0;              ///< since it is sent, final or ended
  };
  struct EarlyCancel {
    std::string id;
    int ticks = 0;
  };
  /// A server's answer to a goal that has not been read yet: two readers have no common order.
  struct EarlyReply {
    RequestId request;
    Bytes cdr;
    int ticks = 0;
  };

  /// Calls the handler; tells a MessageError of it with what was read.
  template <typename Handler>
  void guarded(const char* what, const Handler& handler);
  Goal* find(const GoalUuid& uuid);
  Goal* find(const std::string& id);
  Goal& add(const GoalUuid& uuid, const ActionGoalId& id);
  RequestId send(ActionService service, const Bytes& cdr);
  void onOwnGoal(const Bytes& ros1, Stamp now);
  bool isCanceledEarly(const ActionGoalId& id);
  void onOwnCancel(const ActionGoalId& cancel);
  void onForeignGoal(const RequestId& id, const Bytes& cdr, Stamp now);
  void onForeignCancel(const Bytes& cdr);
  void onGoalReply(Goal& goal, const Bytes& cdr, Stamp now);
  void onResultReply(Goal& goal, const Bytes& cdr, Stamp now);
  void onGoalStatus(const Ros2GoalStatus& told);
  void onAccepted(Goal& goal);
  void sendCancel(const GoalUuid& uuid);
  void endGoal(Goal& goal, GoalState state, const std::string& text, const Bytes& result,
               Stamp now);
  void endOverdue(Goal& goal, Stamp now);
  void publishStatus(Stamp now);

  const ActionType type_;
  const Outlets outlets_;
  std::list<Goal> goals_;
  std::vector<EarlyCancel> early_cancels_;
  std::vector<EarlyReply> early_replies_;
  Stamp last_cancel_;
  std::array<std::optional<std::array<std::uint8_t, 16>>, 3> own_writers_;  ///< by service
};

}  // namespace afterglow::replay
