"""Replaying behaviors by player_node's action."""
import json
import time

from . import beside

ACTION = "/replay"
_TICK_S = 0.02


class ReplayFailed(RuntimeError):
    """The replay was refused, or ended early: in the player's words. report: what was measured until then."""

    def __init__(self, why, report=None):
        RuntimeError.__init__(self, why)
        self.report = report


def play(behavior, action=ACTION, wait=True, timeout_s=5.0, **options):
    """Replays a behavior: its id, its name (the newest), or words such as "last failed pick".

    options: those of `afterglow play`, with _ for -: play(7, rate=0.5, only="ar,speech", pause=True). What is not
    given is as the player's parameters have it; nothing moves that the player was not allowed to move. Returns the
    report as a dict, with wait=False a Replay. action: the player's, in another namespace another; timeout_s: how long
    it is waited for, also where it is gone or silent later. Raises ReplayFailed.
    """
    kind = beside.Replay if beside.is_wanted() else Replay
    replay = kind(behavior, action, timeout_s, options)
    return replay.result() if wait else replay


class Replay(object):
    """A replay under way."""

    def __init__(self, behavior, action, timeout_s, options):
        import actionlib
        import rospy
        from afterglow.msg import ReplayAction, ReplayGoal
        self._client = actionlib.SimpleActionClient(action, ReplayAction)
        if not self._client.wait_for_server(rospy.Duration(timeout_s)):
            raise ReplayFailed("there is no player at " + action)
        self._timeout_s = timeout_s
        self.position = 0.0  #: seconds into the behavior
        self._client.send_goal(ReplayGoal(behavior=str(behavior), options=_words(options)),
                               feedback_cb=self._on_feedback)

    def stop(self):
        """Robot and light stop; result() then raises ReplayFailed."""
        self._client.cancel_goal()

    def is_done(self):
        from actionlib_msgs.msg import GoalStatus
        return self._client.get_state() not in (GoalStatus.PENDING, GoalStatus.ACTIVE)

    def result(self):
        """Waits for the end; the report as a dict."""
        import rospy
        from actionlib import SimpleGoalState
        from actionlib_msgs.msg import GoalStatus
        stuck_s = 0.0
        while self._client.simple_state != SimpleGoalState.DONE:
            time.sleep(_TICK_S)
            trouble = "this node was shut down" if rospy.is_shutdown() else self._trouble()
            stuck_s = stuck_s + _TICK_S if trouble else 0.0
            if rospy.is_shutdown() or stuck_s > self._timeout_s:
                raise ReplayFailed(trouble)
        result = self._client.get_result()
        report = json.loads(result.report) if result and result.report else None
        if self._client.get_state() != GoalStatus.SUCCEEDED:
            raise ReplayFailed(self._client.get_goal_status_text() or "the replay was stopped", report)
        return report

    def _trouble(self):
        """Why a result may never come; empty: the player is at it. Results are sent once, and can be lost."""
        from actionlib import CommState
        from actionlib_msgs.msg import GoalStatus
        goal = self._client.gh
        if self._client.action_client.pub_goal.get_num_connections() == 0:
            return "the player is gone"
        if goal.get_comm_state() == CommState.WAITING_FOR_GOAL_ACK:
            return "the player has not taken it"
        status = goal.get_goal_status()
        if status == GoalStatus.SUCCEEDED:
            return "it was replayed, but the report was lost"
        if status in (GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING, GoalStatus.RECALLING):
            return ""
        return goal.get_goal_status_text() or "the replay was stopped"

    def _on_feedback(self, feedback):
        self.position = feedback.position


def _words(options):
    """{"rate": 0.5, "pause": True, "also": ["/a"]} as "rate=0.5", "pause", "also=/a"."""
    words = []
    for name, value in sorted(options.items()):
        name = name.replace("_", "-")
        if value is True:
            words.append(name)
        elif value is not None and value is not False:
            text = ",".join(value) if isinstance(value, (list, tuple)) else str(value)
            words.append("{}={}".format(name, text))
    return words
