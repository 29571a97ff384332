#!/usr/bin/env python3
"""Whether ros2_bridge_node loses any of 1,000 messages a second each way, between rclpy and rospy, and whether it grows.

  tests/bench/run ros2_soak.py [MINUTES] [HZ]    60, 1000; needs root, for a network that has loopback alone

A line a minute, and status 1 if a message was left out, came twice or out of order. The reader of rclpy is a deep one,
as it falls back by seconds on a busy machine."""
import os
import sys
import time

MINUTES = float(sys.argv[1]) if len(sys.argv) > 1 else 60
HZ = float(sys.argv[2]) if len(sys.argv) > 2 else 1000
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from ros2_world import WHY_NOT, Ros2Node, World, until  # noqa: E402

if WHY_NOT:
    sys.exit("ros2_soak.py: " + WHY_NOT)
import rospy  # noqa: E402
from std_msgs.msg import Int32  # noqa: E402

#: Both Pythons' own: numbers in turn, sent and heard.
NUMBERS = """
import threading, time
class Heard:
    count = lost = late = 0
    def take(self, message):
        self.lost += max(0, message.data - self.count)
        self.late += message.data < self.count
        self.count = max(self.count, message.data + 1)
    def told(self):
        return [self.count, self.lost, self.late]
class Talker(threading.Thread):
    count, is_ending = 0, False
    def __init__(self, send, hz):
        super().__init__(daemon=True)
        self.send, self.hz = send, hz
        self.start()
    def run(self):
        begin = time.monotonic()
        while not self.is_ending:
            self.send(self.count)
            self.count += 1
            time.sleep(max(0, begin + self.count / self.hz - time.monotonic()))
    def end(self):
        self.is_ending = True
        self.join()
"""
ROBOT = NUMBERS + """
heard = Heard()
node.create_subscription(type(message('std_msgs/Int32')), '/there', heard.take, qos(depth=100000))
numbers = publisher('/here', 'std_msgs/Int32')
"""
exec(NUMBERS)


def bridge_of(pid):
    """Seconds of CPU, and MB of memory."""
    with open("/proc/{}/stat".format(pid)) as file:
        fields = file.read().rsplit(")", 1)[1].split()
    seconds = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return seconds, int(fields[21]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def line(begin):
    seconds, megabytes = bridge_of(world.bridge.pid)
    there, sent = robot.run("answer = [heard.told(), talker.count]")
    ways = ["{} {} of {}, {} left out, {} late".format(name, told[0], count, *told[1:]) for name, told, count in
            (("ROS 1 to 2:", there, own.count), ("ROS 2 to 1:", heard.told(), sent))]
    minutes = (time.monotonic() - begin) / 60
    print("{:6.1f} min   {}   {}   bridge {:.1f} % CPU, {:.1f} MB".format(
        minutes, *ways, 100 * seconds / (60 * minutes), megabytes), flush=True)
    return sum(there[1:] + heard.told()[1:]) + own.count - there[0] + sent - heard.count


world = World("ros2_soak")
robot = Ros2Node("robot")
try:
    robot.run(ROBOT)
    heard, publisher = Heard(), rospy.Publisher("/there", Int32, queue_size=1000)
    subscriber = rospy.Subscriber("/here", Int32, heard.take, tcp_nodelay=True)
    until(lambda: publisher.get_num_connections() == 1 and subscriber.get_num_connections() == 1, "the bridge")
    robot.until("numbers.get_subscription_count() == 1")
    begin = time.monotonic()
    own = Talker(lambda count: publisher.publish(count), HZ)
    robot.run("talker = Talker(lambda count: numbers.publish(message('std_msgs/Int32', data=count)), {})".format(HZ))
    while time.monotonic() < begin + 60 * MINUTES:
        time.sleep(min(60, max(0, begin + 60 * MINUTES - time.monotonic())))
        line(begin)
    own.end()
    robot.run("talker.end()")
    time.sleep(2)
    lost = line(begin)
finally:
    robot.end()
    world.end()
sys.exit(1 if lost else 0)
