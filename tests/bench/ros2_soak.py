#!/usr/bin/env python3
"""Whether ros2_bridge_node loses any of 1,000 messages a second each way, between rclpy and rospy, and whether it grows.

  tests/bench/run ros2_soak.py [MINUTES] [HZ]    60, 1000; needs root, for a network that has loopback alone

A line a minute with the bridge's own counts, CPU and memory of each program, and how busy the machine was; at last a
verdict, with the bridge's memory after a second and at the end: status 1 if a message was left out, came twice or out of
order. Queues of both Pythons are deep, as these fall back by seconds on a busy machine; rospy's has no limit, as it says
nothing of what it drops."""
import os
import sys
import time

MINUTES = float(sys.argv[1]) if len(sys.argv) > 1 else 60
HZ = float(sys.argv[2]) if len(sys.argv) > 2 else 1000
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from numbered import Heard, Talker, hear_the_rest, missing  # noqa: E402
from ros2_world import WHY_NOT, Ros2Node, World, until  # noqa: E402

if WHY_NOT:
    sys.exit("ros2_soak.py: " + WHY_NOT)
import rospy  # noqa: E402
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from std_msgs.msg import Int32  # noqa: E402

ROBOT = """
from numbered import Heard, Talker
heard = Heard()
node.create_subscription(type(message('std_msgs/Int32')), '/there', heard.take, qos(depth=100000))
numbers = publisher('/here', 'std_msgs/Int32', depth=100000)
"""


def cost_of(pid):
    """Seconds of CPU, and MB of memory."""
    with open("/proc/{}/stat".format(pid)) as file:
        fields = file.read().rsplit(")", 1)[1].split()
    seconds = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return seconds, int(fields[21]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def take_counts(array):
    for status in array.status:
        if status.hardware_id == "ros2_bridge":
            counts.update((one.key, one.value) for one in status.values)


def line(begin):
    there, sent = robot.run("answer = [heard.told(), talker.count]")
    ways = ["{} {} of {}, {} left out, {} late; bridge: {}".format(name, told[0], count, *told[1:], counts.get(key, "no counts"))
            for name, told, count, key in (("ROS 1 to 2:", there, own.count, "/there to ROS 2"),
                                           ("ROS 2 to 1:", heard.told(), sent, "/here to ROS 1"))]
    minutes = (time.monotonic() - begin) / 60
    costs = ["{} {:.1f} % CPU, {:.1f} MB".format(name, 100 * (seconds - before[name]) / (60 * minutes), megabytes)
             for name, (seconds, megabytes) in ((name, cost_of(pid)) for name, pid in programs.items())]
    print("{:6.1f} min   {}\n             {}\n             {}; load {}".format(
        minutes, *ways, ", ".join(costs), open("/proc/loadavg").read().split()[0]), flush=True)
    return missing(own.count, there) + missing(sent, heard.told()) + there[2] + heard.late


world = World("ros2_soak")
robot = Ros2Node("robot", "one-thread", "first")
try:
    robot.run(ROBOT)
    heard, counts, publisher = Heard(), {}, rospy.Publisher("/there", Int32, queue_size=0)
    rospy.Subscriber("/diagnostics", DiagnosticArray, take_counts)
    subscriber = rospy.Subscriber("/here", Int32, heard.take, tcp_nodelay=True)
    until(lambda: publisher.get_num_connections() == 1 and subscriber.get_num_connections() == 1, "the bridge")
    robot.until("numbers.get_subscription_count() == 1")
    programs = {"bridge": world.bridge.pid, "rclpy": robot.process.pid, "rospy": os.getpid()}
    before = {name: cost_of(pid)[0] for name, pid in programs.items()}
    begin = time.monotonic()
    own = Talker(lambda count: publisher.publish(count), HZ)
    robot.run("talker = Talker(lambda count: numbers.publish(message('std_msgs/Int32', data=count)), {})".format(HZ))
    time.sleep(1)
    memory = cost_of(world.bridge.pid)[1]
    while time.monotonic() < begin + 60 * MINUTES:
        time.sleep(min(60, max(0, begin + 60 * MINUTES - time.monotonic())))
        line(begin)
    seconds = time.monotonic() - begin
    own.end()
    sent = robot.run("talker.end(); answer = talker.count")
    hear_the_rest(lambda: [robot.run("answer = heard.count"), heard.count], [own.count, sent])
    lost = line(begin)
    print("{}: {} of {} + {} messages left out or out of order, {:.0f} + {:.0f} a second; the bridge's memory: {:.1f} MB "
          "after a second, {:.1f} MB at the end".format("FAILED" if lost else "passed", lost, own.count, sent,
                                                        own.count / seconds, sent / seconds, memory,
                                                        cost_of(world.bridge.pid)[1]), flush=True)
finally:
    robot.end()
    world.end()
sys.exit(1 if lost else 0)
