"""A server of actionlib for test_msgs/Fibonacci, as ROS 1 would have that action: ros1_fibonacci.py NODE ACTION.

A goal of order 100 lasts until it is canceled, one of order 0 is aborted, lower ones are rejected."""
import sys
import threading
import time

LONG = 100
FIELDS = {"goal": "int32 order", "result": "int32[] sequence", "feedback": "int32[] sequence"}


def fibonacci():
    """The action as genpy has it by the definitions that genaction would make, and actionlib takes it."""
    from actionlib_msgs.msg import GoalID, GoalStatus
    from genpy.dynamic import generate_dynamic
    from std_msgs.msg import Header
    line = "\n" + "=" * 80 + "\nMSG: "
    contained = (line + "std_msgs/Header\n" + Header._full_text + line + "actionlib_msgs/GoalID\n" + GoalID._full_text +
                 line + "actionlib_msgs/GoalStatus\n" + GoalStatus._full_text.split("=" * 80)[0])

    class Action:
        pass
    for part, fields in FIELDS.items():
        name = part.capitalize()
        head = "actionlib_msgs/GoalID goal_id" if part == "goal" else "actionlib_msgs/GoalStatus status"
        whole = "std_msgs/Header header\n{}\nFibonacci{} {}".format(head, name, part)
        kind = "test_msgs/FibonacciAction" + name
        made = generate_dynamic(kind, whole + contained + line + "test_msgs/Fibonacci" + name + "\n" + fields)
        setattr(Action, "action_" + part, made[kind]())
    return Action


class Server:
    """Does any number of goals at the same time."""
    def __init__(self, action):
        import actionlib
        self.spec, self.canceled = fibonacci(), set()
        self.server = actionlib.ActionServer(action, self.spec, self.take, self.cancel, auto_start=False)
        self.server.start()

    def result(self, count):
        return type(self.spec.action_result.result)(sequence=list(range(count)))

    def take(self, goal):
        if goal.get_goal().order < 0:
            return goal.set_rejected(self.result(0), "too low")
        goal.set_accepted()
        threading.Thread(target=self.work, args=(goal,), daemon=True).start()

    def cancel(self, goal):
        self.canceled.add(goal.get_goal_id().id)

    def work(self, goal):
        order, name = goal.get_goal().order, goal.get_goal_id().id
        goal.publish_feedback(type(self.spec.action_feedback.feedback)(sequence=[0, 1]))
        while order == LONG and name not in self.canceled:
            time.sleep(0.01)
        if name in self.canceled:
            goal.set_canceled(self.result(1))
        elif order == 0:
            goal.set_aborted(self.result(0))
        else:
            goal.set_succeeded(self.result(order))


if __name__ == "__main__":
    sys.path.append("/usr/lib/python3/dist-packages")
    import rospy
    rospy.init_node(sys.argv[1])
    server = Server(sys.argv[2])
    rospy.spin()
