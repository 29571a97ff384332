"""A network that has loopback alone, with a master, ros2_bridge_node and nodes of rclpy in it.

To be imported before rospy: it starts the program anew in that network. rclpy is Kilted's, or that of the distribution
that AFTERGLOW_TEST_ROS2 names (jazzy)."""
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
#: The first argument of a test; benchmarks have other ones.
BUILD = os.path.abspath(sys.argv[1] if os.path.isdir("".join(sys.argv[1:2])) else os.path.join(HERE, "..", "..", "build"))
BRIDGE = os.path.join(BUILD, "bin", "ros2_bridge_node")
DISTRIBUTION = os.environ.get("AFTERGLOW_TEST_ROS2", "kilted")
ROS2 = os.path.join(BUILD, "python_ros2" if DISTRIBUTION == "kilted" else "python_ros2_" + DISTRIBUTION)
PYTHON = os.path.join(ROS2, "bin", "python")
sys.path[:0] = [HERE, "/usr/lib/python3/dist-packages"]
from free_port import free_port  # noqa: E402

INSIDE = "AFTERGLOW_TEST_LOOPBACK"
LOOPBACK = "ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo && exec \"$@\""
WAIT_S = 30


def why_not():
    if not os.path.exists(BRIDGE):
        return "no bridge was built: Fast DDS is not here"
    if not os.path.exists(PYTHON):
        return "no rclpy in {}; nodes/setup --tests gets it from PyPI".format(ROS2)
    if not shutil.which("ip") or subprocess.call(["unshare", "-n", "true"], stderr=subprocess.DEVNULL):
        return "a network of its own needs root and ip (iproute2)"
    return ""


WHY_NOT = why_not()  # it cannot run; empty: it can
if not WHY_NOT and not os.environ.get(INSIDE):
    os.environ[INSIDE] = "1"
    os.execvp("unshare", ["unshare", "-n", "sh", "-c", LOOPBACK, "sh", sys.executable] + sys.argv)

HOME = tempfile.TemporaryDirectory(prefix="afterglow_test.")
PORT = 0 if WHY_NOT else free_port()
os.environ.update(ROS_HOME=HOME.name, ROS_LOG_DIR=HOME.name, ROS_IP="127.0.0.1", ROS_DOMAIN_ID="7",
                  FASTDDS_BUILTIN_TRANSPORTS="UDPv4", ROS_MASTER_URI="http://127.0.0.1:{}".format(PORT))
os.environ.pop("ROS_AUTOMATIC_DISCOVERY_RANGE", None)


def until(condition, what):
    """Looks again and again; the time of a busy machine is no failure."""
    for _ in range(int(WAIT_S / 0.02)):
        found = condition()
        if found:
            return found
        time.sleep(0.02)
    raise AssertionError(what + " did not come about")


class Ros2Node:
    """A program of rclpy; `variables` of its environment replace this program's, None: it has none. `inside`: a command
    that runs it elsewhere."""
    def __init__(self, name, *arguments, inside=(), **variables):
        environment = {key: value for key, value in dict(os.environ, PYTHONPATH=None, **variables).items()
                       if value is not None}
        self.process = subprocess.Popen([*inside, PYTHON, os.path.join(HERE, "ros2_peer.py"), name, *arguments],
                                        env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, universal_newlines=True)
        self.process.stdout.readline()

    def run(self, code):
        """Returns what it leaves in `answer`."""
        self.process.stdin.write(json.dumps(code) + "\n")
        self.process.stdin.flush()
        told = json.loads(self.process.stdout.readline())
        if "error" in told:
            raise AssertionError(told["error"])
        return told["answer"]

    def until(self, expression):
        return until(lambda: self.run("answer = bool({})".format(expression)), expression)

    def end(self):
        self.process.kill()
        self.process.wait()
        self.process.stdin.close()
        self.process.stdout.close()


class World:
    """Master, bridge, and this program as a node of ROS 1, until end()."""
    def __init__(self, name):
        import rosgraph
        import rospy
        self.master = subprocess.Popen(["rosmaster", "--core", "-p", str(PORT)], stdout=subprocess.DEVNULL)
        until(rosgraph.is_master_online, "a master")
        rospy.init_node(name, disable_signals=True)
        self.bridge = subprocess.Popen([BRIDGE], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)

    def end(self):
        """Returns the bridge's exit status."""
        import rospy
        for process in (self.bridge, self.master):
            process.send_signal(signal.SIGINT)
            process.wait()
        rospy.signal_shutdown("done")
        return self.bridge.returncode
