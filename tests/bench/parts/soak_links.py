"""What passes the bridge to ROS 2, and the console's WebSocket, in tests/bench/soak."""
import types
import xmlrpc.client

import fetch_world
import foxglove_client
import numbered
import ros2_world

HZ = 100
FROM_ROS1, FROM_ROS2 = "/soak/from_ros1", "/soak/from_ros2"
PICTURES, MARKERS = "/projector_node/image", "/soak/markers"
PATIENCE_S = 60
QUEUE = 10000
ROBOT = f"""
from numbered import Heard, Talker
heard, counts = Heard(), {{}}
def hear(topic, kind, take):
    node.create_subscription(type(message(kind)), topic, take, qos(depth={QUEUE}))
def count(topic, kind):
    counts[topic] = 0
    def take(_):
        counts[topic] += 1
    hear(topic, kind, take)
hear('{FROM_ROS1}', 'std_msgs/Int32', heard.take)
count('/cmd_vel', 'geometry_msgs/TwistStamped')
count('{MARKERS}', 'visualization_msgs/MarkerArray')
numbers = publisher('{FROM_ROS2}', 'std_msgs/Int32', depth={QUEUE})
def send(number):
    numbers.publish(message('std_msgs/Int32', data=number))
"""


def why_no_ros2(build):
    """It cannot run; empty: it can."""
    if not (build / "bin/ros2_bridge_node").exists():
        return f"no bridge in {build}: Fast DDS is not here"
    return ros2_world.WHY_NOT


class FoxgloveClient(foxglove_client.Client):
    """Counts what it hears of some topics."""
    def __init__(self, world, port):
        self.heard = {topic: numbered.Heard() for topic in (FROM_ROS1, FROM_ROS2)}
        self.counts, self.warnings = {}, []
        super().__init__(str(world.build), f"ws://127.0.0.1:{port}/", "foxglove.sdk.v1")
        world.processes.append(self.process)

    def take(self, event):
        kind = event["event"]
        if kind == "message":
            topic = event["topic"]
            self.counts[topic] = self.counts.get(topic, 0) + 1
            if topic in self.heard:
                self.heard[topic].take(types.SimpleNamespace(**event["value"]))
        elif kind in ("status", "error"):
            self.warnings.append(event.get("message") or event.get("text"))
        elif kind in ("advertise", "unadvertise"):
            super().take(event)

    def subscribe(self, *topics):
        fetch_world.wait_until(lambda: set(topics) <= set(self.topics()),
                               f"the console's {' and '.join(topics)}", PATIENCE_S)
        for topic in topics:
            self.do("subscribe", topic=topic)


class Links:
    """Begins with its making: a robot of rclpy behind bridge and watch, two clients of the console.

    The robot drives by /cmd_vel, too, so that what a player moves needs the watch. A client that is
    too slow for pictures loses the oldest, and is told; numbers have a client of their own."""
    def __init__(self, world):
        import rospy
        from std_msgs.msg import Int32
        self.without, self.passed, self.robot, self.client = [], {}, None, None
        self.heard_in_ros2 = {}
        publisher = rospy.Publisher(FROM_ROS1, Int32, queue_size=0)
        self.heard = numbered.Heard()
        why_not = why_no_ros2(world.build)
        if why_not:
            self.without.append(f"without the bridge to ROS 2: {why_not}")
        else:
            self.begin_ros2(world)
            rospy.Subscriber(FROM_ROS2, Int32, self.heard.take, tcp_nodelay=True)
        why_not = foxglove_client.why_not(str(world.build))
        if why_not:
            self.without.append(f"without a client of Foxglove: {why_not}")
        self.begin_console(world, not why_not)
        self.await_listeners(publisher)
        self.talker = numbered.Talker(publisher.publish, HZ)
        if self.robot:
            self.robot.run(f"talker = Talker(send, {HZ})")

    def begin_ros2(self, world):
        world.run_node("afterglow_ros2_watch")
        world.run_node("ros2_bridge_node")
        self.robot = ros2_world.Ros2Node("robot", "one-thread")
        world.processes.append(self.robot.process)
        world.pids["rclpy"] = self.robot.process.pid
        self.robot.run(ROBOT)

    def begin_console(self, world, has_client):
        port = fetch_world.free_port()
        world.run_node("console_node", store=world.store, port=port, projector=PICTURES)
        fetch_world.wait_until(lambda: world.answers("127.0.0.1", port), "the console", PATIENCE_S)
        if not has_client:
            return
        self.client, self.viewer = FoxgloveClient(world, port), FoxgloveClient(world, port)
        world.pids["foxglove"] = self.client.process.pid
        world.pids["foxglove_viewer"] = self.viewer.process.pid
        self.client.subscribe(FROM_ROS1, *([FROM_ROS2] if self.robot else []))
        self.viewer.subscribe(PICTURES, MARKERS, "/tf")

    def await_listeners(self, publisher):
        """Nothing is lost before it begins."""
        listeners = bool(self.robot) + bool(self.client)
        fetch_world.wait_until(lambda: publisher.get_num_connections() == listeners,
                               f"{listeners} listeners of {FROM_ROS1}", PATIENCE_S)
        if self.robot:
            wanted = {"/witness"} | ({"/console_node"} if self.client else set())
            fetch_world.wait_until(lambda: wanted <= listeners_of("/ros2_bridge_node", FROM_ROS2),
                                   f"listeners of {FROM_ROS2}", PATIENCE_S)
            self.robot.until("numbers.get_subscription_count() == 1")

    def look(self):
        """{way: (sent, [heard, left out, late])}, of numbers; sent is asked last."""
        viewed = {topic: heard.told() for topic, heard in self.client.heard.items()
                  } if self.client else {}
        heard_here, passed, there = self.heard.told(), {}, 0
        if self.robot:
            heard_there, there, self.heard_in_ros2 = self.robot.run(
                "answer = heard.told(), talker.count, counts")
            passed["ROS 1 to ROS 2"] = self.talker.count, heard_there
            passed["ROS 2 to ROS 1"] = there, heard_here
        if self.client:
            passed["ROS 1 to Foxglove"] = self.talker.count, viewed[FROM_ROS1]
        if self.client and self.robot:
            passed["ROS 2 to Foxglove"] = there, viewed[FROM_ROS2]
        self.passed = passed
        return passed

    def end(self):
        """What is under way arrives; then passed says what there was."""
        self.talker.end()
        if self.robot:
            self.robot.run("talker.end()")
        sent = [count for count, _ in self.look().values()]
        numbered.hear_the_rest(lambda: [told[0] for _, told in self.look().values()], sent)
        if self.robot:
            self.robot.end()
        if self.client:
            self.client.close()
            self.viewer.close()

    def pictures(self):
        """How many the viewer has until now."""
        return self.viewer.counts.get(PICTURES, 0) if self.client else 0

    def besides(self):
        """[(what, how much)], without a promise."""
        rows = [(f"{topic} in ROS 2", count) for topic, count in self.heard_in_ros2.items()]
        if self.client:
            rows += [(f"{topic} in Foxglove", count) for topic, count in self.viewer.counts.items()]
            rows += [("warnings to the viewer of pictures, to the other client",
                      f"{len(self.viewer.warnings)}, {len(self.client.warnings)}")]
        return rows


def listeners_of(node, topic):
    import rosgraph
    uri = rosgraph.Master("/witness").lookupNode(node)
    connections = xmlrpc.client.ServerProxy(uri).getBusInfo("/witness")[2]
    return {one[1] for one in connections if one[2] == "o" and one[4] == topic}
