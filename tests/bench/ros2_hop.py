#!/usr/bin/env python3
"""How long a message takes from rclpy to rclpy, and from rclpy over ros2_bridge_node to rospy; and the bridge's CPU.

  tests/bench/run ros2_hop.py [SECONDS]    10 s for each size; needs root, for a network that has loopback alone

Times are from before publish() to the callback, with all that Python adds on either side."""
import os
import struct
import sys
import time

SECONDS = float(sys.argv[1]) if len(sys.argv) > 1 else 10
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from ros2_world import WHY_NOT, Ros2Node, World, until  # noqa: E402

if WHY_NOT:
    sys.exit("ros2_hop.py: " + WHY_NOT)
import rospy  # noqa: E402

KIND = "std_msgs/UInt8MultiArray"
TALK = """
import array, struct, time
def talk(talker, size, hz, seconds):
    text = message('std_msgs/UInt8MultiArray', data=array.array('B', bytes(size)))
    start = time.monotonic()
    for i in range(int(hz * seconds)):
        time.sleep(max(0, start + i / hz - time.monotonic()))
        text.data[0:8] = array.array('B', struct.pack('<q', time.monotonic_ns()))
        talker.publish(text)
"""
HEAR = """
import struct, time
late = []
def take(heard):
    late.append(time.monotonic_ns() - struct.unpack('<q', bytes(heard.data[0:8]))[0])
node.create_subscription(type(message('std_msgs/UInt8MultiArray')), '/direct', take, qos())
"""


def line(name, late_ns, count, cpu_ms=None):
    late = sorted(late_ns)
    told = [late[int(len(late) * part)] / 1e6 for part in (0.5, 0.99)] if late else [float("nan")] * 2
    cpu = "" if cpu_ms is None else "   bridge's CPU {:.2f} ms a message".format(cpu_ms)
    print("  {:24} p50 {:8.2f} ms   p99 {:8.2f} ms   {} of {}{}".format(name, *told, len(late), count, cpu), flush=True)


def cpu_s(process):
    with open("/proc/{}/stat".format(process.pid)) as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def measure(world, robot, other, size, hz):
    count = int(hz * SECONDS)
    print("{:,} bytes at {} Hz".format(size, hz))
    other.run("late.clear()")
    robot.run("talk(direct, {}, {}, {})".format(size, hz, SECONDS))
    time.sleep(1)
    line("rclpy to rclpy", other.run("answer = late"), count)
    late = []

    def take(heard):
        # Behind an empty layout, and the array's length.
        late.append(time.monotonic_ns() - struct.unpack_from("<q", heard._buff, 12)[0])

    subscriber = rospy.Subscriber("/bridged", rospy.AnyMsg, take, buff_size=1 << 24)
    robot.until("bridged.get_subscription_count() == 1")
    before = cpu_s(world.bridge)
    robot.run("talk(bridged, {}, {}, {})".format(size, hz, SECONDS))
    time.sleep(1)
    line("rclpy, bridge, rospy", late, count, 1e3 * (cpu_s(world.bridge) - before) / count)
    subscriber.unregister()
    robot.until("bridged.get_subscription_count() == 0")


world = World("ros2_hop")
robot, other = (Ros2Node(name, "one-thread") for name in ("robot", "other"))
try:
    robot.run(TALK)
    other.run(HEAR)
    robot.run("direct, bridged = (publisher(topic, '{}', depth=10) for topic in ('/direct', '/bridged'))".format(KIND))
    robot.until("direct.get_subscription_count() == 1")
    until(lambda: "/bridged" in dict(rospy.get_published_topics()), "an advertisement")
    for size, hz in ((1000, 100), (1000000, 30), (10000000, 5)):
        measure(world, robot, other, size, hz)
finally:
    for node in (robot, other):
        node.end()
    world.end()
