"""A robot for the console's tests: master, player_node and console_node as they are, and wheels that listen."""
import http.client
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time

BUILD, DEVEL = (os.path.abspath(path) for path in sys.argv[1:3])
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "..", "support"), os.path.join(DEVEL, "lib/python3/dist-packages"),
                "/usr/lib/python3/dist-packages"]
from free_port import free_port  # noqa: E402

BIN = os.path.join(BUILD, "bin")
HOME = tempfile.TemporaryDirectory(prefix="afterglow_test.")
os.environ["ROS_HOME"] = os.environ["ROS_LOG_DIR"] = HOME.name
STORE = os.path.join(HOME.name, "store.db")
PORT = free_port()
os.environ["ROS_MASTER_URI"] = "http://127.0.0.1:{}".format(PORT)
os.environ["ROS_IP"] = "127.0.0.1"

import rosgraph  # noqa: E402
import rospy  # noqa: E402
from geometry_msgs.msg import TransformStamped, Twist  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402

import recordings  # noqa: E402

# Debian 11's rospy ends its threads by a method that its Python 3.9 no longer has, and would hang at the end.
if not hasattr(threading.Thread, "isAlive"):
    threading.Thread.isAlive = threading.Thread.is_alive

WAIT_S = 30
SHORT, LONG = 1, 2  # behaviors: of 2 s, of a minute
PLAYER = {"allow_motion": True, "open_loop": True, "no_scan": True, "any_start": True, "longest_stall": 1.0,
          "also": ["/robotsound", "/projector/nav/path"], "anchor": ["body"], "realtime": False}
PROJECTOR = """
fixed_frame: map
projector: {camera_info: projector_camera_info.yaml, frame: projector_optical_frame}
layers: [{topic: /projector/nav/path, type: visualization_msgs/MarkerArray}]
"""
DEMO = os.path.join(HERE, "..", "..", "assets", "demo")  # has the calibration


def projector_config():
    """A file, for pictures of SHORT."""
    path = os.path.join(HOME.name, "projector.yaml")
    with open(path, "w") as file:
        file.write(PROJECTOR)
    return path


def projector_above():
    """Two meters above the markers, looking down."""
    above = TransformStamped(child_frame_id="projector_optical_frame")
    above.header.frame_id = "map"
    above.transform.translation.z, above.transform.rotation.x = 2, 1
    return TFMessage(transforms=[above])


def start(*command):
    return subprocess.Popen(command, stdout=subprocess.DEVNULL)


def until(condition, what):
    """Looks again and again; the time of a busy machine is no failure."""
    for _ in range(int(WAIT_S / 0.01)):
        found = condition()
        if found:
            return found
        rospy.rostime.wallsleep(0.01)
    raise AssertionError(what + " did not come about")


class Console:
    def __init__(self, *parameters):
        self.process = subprocess.Popen([os.path.join(BIN, "console_node"), "_store:=" + STORE, "_port:=0", *parameters],
                                        stdout=subprocess.PIPE, universal_newlines=True)
        self.port = int(re.search(r":(\d+)/", self.process.stdout.readline())[1])

    def heard(self, path):
        """The headers of the answer."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=WAIT_S)
        connection.request("GET", path)
        answer = connection.getresponse()
        answer.read()
        connection.close()
        return answer.headers

    def ask(self, method, path, body=None, **headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=WAIT_S)
        if body is not None:
            headers["Content-Type"] = "application/json"
        connection.request(method, path, None if body is None else json.dumps(body), headers)
        answer = connection.getresponse()
        text = answer.read()
        connection.close()
        return answer.status, json.loads(text) if answer.getheader("Content-Type") == "application/json" else text

    def get(self, path, **headers):
        return self.ask("GET", path, **headers)

    def post(self, path, **body):
        return self.ask("POST", path, body)

    def end(self, how=signal.SIGTERM):
        if self.process.poll() is None:
            self.process.send_signal(how)
        self.process.wait(WAIT_S)
        self.process.stdout.close()


class Wheels:
    """Hears /cmd_vel."""
    def __init__(self):
        self.at = self.last_moving = 0
        self.speed = 0
        self.subscriber = rospy.Subscriber("/cmd_vel", Twist, self.hear, queue_size=1000)

    def hear(self, twist):
        self.at, self.speed = time.monotonic(), twist.linear.x
        if self.speed:
            self.last_moving = self.at

    def await_motion(self):
        since = time.monotonic()
        until(lambda: self.last_moving > since, "motion")

    def await_rest(self):
        """Until the last velocity is a zero."""
        until(lambda: self.speed == 0, "rest")
        return self.at


class World:
    """Until close(). Behaviors SHORT and LONG say and show something, and drive."""
    def __init__(self):
        bag = os.path.join(HOME.name, "one.bag")
        for begin, length, words in ((0, 2, ["I have it."]), (3600, 60, ["I drive."])):
            more = [("/tf_static", projector_above())] if begin == 0 else []
            recordings.write_bag(bag, recordings.BEGIN_S + begin, length, words, more=more)
            recordings.import_bags(os.path.join(BIN, "afterglow"), STORE, [bag], "--name", "pick")
        self.master = start("rosmaster", "--core", "-p", str(PORT))
        until(rosgraph.Master("/console_test").is_online, "the master")
        rospy.init_node("console_test", disable_signals=True)
        self.wheels = Wheels()
        self.start_player()
        self.console = Console()

    def start_player(self, **changes):
        rospy.set_param("/player_node", dict(PLAYER, **{"store": STORE, **changes}))
        self.player = start(os.path.join(BIN, "player_node"))
        rospy.wait_for_service("/player_node/play", WAIT_S)

    def close(self):
        self.console.end()
        end(self.player)
        rospy.signal_shutdown("done")
        end(self.master, signal.SIGKILL)
        HOME.cleanup()


def end(process, how=signal.SIGTERM):
    process.send_signal(how)
    process.wait(WAIT_S)
