#!/usr/bin/env python3
"""How late replayed messages are: afterglow heard by rclpy over ros2_bridge_node, beside rosbag play heard by rospy.

  tests/bench/run ros2_lateness.py [SECONDS] [ROUNDS]    12, 5; needs root, for a network that has loopback alone

The same 100 numbers and 30 markers a second, by turns; errors are against the recorded rhythm, from each round's
median: as the bridge wrote them, as the robot's DDS had them (both by the robot's own stamps), and with all that Python
adds where they are heard. PyPI has no rosbag2, which would be the peer on ROS 2."""
import os
import subprocess
import sys
import time

SECONDS = float(sys.argv[1]) if len(sys.argv) > 1 else 12
ROUNDS = int(sys.argv[2]) if len(sys.argv) > 2 else 5
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from ros2_world import BUILD, HOME, WHY_NOT, Ros2Node, World  # noqa: E402

if WHY_NOT:
    sys.exit("ros2_lateness.py: " + WHY_NOT)
import rosbag  # noqa: E402
import rospy  # noqa: E402
from std_msgs.msg import Int32  # noqa: E402
from visualization_msgs.msg import Marker, MarkerArray  # noqa: E402

STREAMS = {"/numbers": 100, "/marks": 30}  # topic: Hz
BAG, STORE, AFTERGLOW = (os.path.join(*parts) for parts in (
    (HOME.name, "timing.bag"), (HOME.name, "timing.db"), (BUILD, "bin", "afterglow")))
#: Both Pythons' own: when each message was heard, by its number; behind it, when it was written and received.
HEAR = """
import time
heard = {'/numbers': {}, '/marks': {}}
def hear_number(message, *stamps):
    heard['/numbers'].setdefault(message.data, (time.time(), *stamps))
def hear_marks(message, *stamps):
    if message.markers[0].action == 0:
        heard['/marks'].setdefault(message.markers[0].id, (time.time(), *stamps))
"""
ROBOT = HEAR + """
def stamped(hear):
    return lambda message, info: hear(message, 1e-9 * info['source_timestamp'], 1e-9 * info['received_timestamp'])
node.create_subscription(type(message('std_msgs/Int32')), '/numbers', stamped(hear_number), qos())
node.create_subscription(type(message('visualization_msgs/MarkerArray')), '/marks', stamped(hear_marks), qos())
"""
exec(HEAR)


def write():
    with rosbag.Bag(BAG, "w") as bag:
        for topic, hz in STREAMS.items():
            for i in range(int(SECONDS * hz)):
                message = Int32(i) if topic == "/numbers" else MarkerArray([Marker(id=i) for _ in range(20)])
                bag.write(topic, message, rospy.Time(1600000000) + rospy.Duration(i / hz))
    subprocess.run([AFTERGLOW, "import", BAG, "--store", STORE], check=True, stdout=subprocess.DEVNULL)


def take(told, figures, *stages):
    for topic, hz in STREAMS.items():
        for place, stage in enumerate(stages):
            errors = sorted(1e3 * (at[place] - int(i) / hz) for i, at in told[topic].items())
            middle = errors[len(errors) // 2]
            sizes = sorted(abs(error - middle) for error in errors)
            figures.setdefault((topic, stage), []).append(
                [sizes[int(part * (len(sizes) - 1))] for part in (0.5, 0.99, 1)])
            print("{:9} {:24} p50 {:7.3f}   p99 {:7.3f}   max {:7.3f} ms   {} of {}".format(
                topic, stage, *figures[topic, stage][-1], len(errors), int(SECONDS * hz)), flush=True)
        told[topic].clear()


world = World("ros2_lateness")
robot = Ros2Node("robot", "one-thread")
try:
    write()
    robot.run(ROBOT)
    time.sleep(2)  # the bridge has met its readers
    figures = {}
    for _ in range(ROUNDS):
        subprocess.run([AFTERGLOW, "play", "1", "--store", STORE, "--topics", "/numbers", "/marks", "--hold", "0",
                        "--quiet", "--no-keys", "--allow-motion", "--wait-for-subscribers", "10"], check=True,
                       stdin=subprocess.DEVNULL)
        time.sleep(1)
        take(robot.run("answer = heard"), figures, "afterglow, bridge, rclpy", "  written by the bridge",
             "  received by DDS")
        robot.run("[one.clear() for one in heard.values()]")
        subscribers = [rospy.Subscriber("/numbers", Int32, hear_number, tcp_nodelay=True),
                       rospy.Subscriber("/marks", MarkerArray, hear_marks, tcp_nodelay=True)]
        subprocess.run(["rosbag", "play", "-q", "--wait-for-subscribers", BAG], check=True, stdin=subprocess.DEVNULL)
        take(heard, figures, "rosbag play, rospy")
        for subscriber in subscribers:
            subscriber.unregister()
        robot.run("[one.clear() for one in heard.values()]")
    for (topic, player), rounds in sorted(figures.items()):
        p99s = sorted(p99 for _, p99, _ in rounds)
        print("{:9} {:24} median p99 {:.2f} ms, worst {:.2f}".format(topic, player, p99s[len(p99s) // 2], p99s[-1]))
finally:
    robot.end()
    world.end()
