#!/usr/bin/python3
"""A robot and a workstation with a poor link between them: what arrives, how late, and what breaks.

    tests/bench/two_machines.py [--build build] [--delay 50] [--loss 1] [--cut 5]

On the robot: roscore, fake_fetch_node with its sensors, afterglow_guard, recorder_node. On the workstation, a network
namespace behind a relay that delays each packet and loses some (parts/slow_link.py; as root): projector_node,
player_node, and a second recorder_node for comparison. Prints what each lost of numbered messages, how late light is
on the workstation, how well replays keep their rhythm as the robot hears them; then the link is cut, and the same
again. Needs the Python of ROS.
"""
import argparse
import json
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

sys.dont_write_bytecode = True  # the source tree stays as it is
import fetch_world  # noqa: E402
import projector_latency  # noqa: E402
from parts import soak_work  # noqa: E402

HERE, THERE, SPACE = "10.213.8.1", "10.213.8.2", "afterglow_workstation"
SECONDS, NUMBERS_HZ, COLORS_HZ = 20, 50, 10
SIZE = "320x200"
LATEST_S = 15  # after a replay's end, until its marks have come


class Link:
    def __init__(self, delay, loss):
        self.relay = subprocess.Popen([sys.executable, str(Path(__file__).parent / "parts/slow_link.py"), SPACE, HERE,
                                       THERE, "--delay", str(delay), "--loss", str(loss)],
                                      stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        if self.relay.stdout.readline() != "ready\n":
            sys.exit("two_machines: no second machine: needs root, iproute2 and /dev/net/tun")

    def say(self, word):
        self.relay.stdin.write(word + "\n")
        self.relay.stdin.flush()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.relay.stdin.close()
        self.relay.wait()


class TwoMachines(fetch_world.World):
    def afar(self, *command):
        return self.start("ip", "netns", "exec", SPACE, "env", "ROS_HOSTNAME=" + THERE, *command)

    def node_afar(self, name, *words, **parameters):
        return self.afar(self.build / "bin" / name, *words,
                         *[f"_{key}:={value}" for key, value in parameters.items()])

    def set_up(self):
        import rospy
        self.eye = projector_latency.transform(rospy)
        self.node("fake_fetch_node")
        self.node("afterglow_guard")
        self.node("recorder_node", store=self.store)
        self.node_afar("recorder_node", "__name:=recorder_afar", store=self.folder / "afar.db", mongodb_logger="false")
        self.node_afar("projector_node", config=soak_work.configuration(str(self.folder), SIZE), window="false",
                       rate=15)
        # Longer than by default, which refuses motion over such a link: the emergency stop is heard too late.
        for name, value in (("allow_motion", True), ("robot", "fetch"), ("to_start", True), ("hold", 0),
                            ("estop_longest_silence", 3)):
            rospy.set_param("/player_node/" + name, value)
        self.node_afar("player_node", store=self.store)
        self.eyes = self.folder / "eyes.txt"
        self.afar(sys.executable, __file__, "--eyes", self.eyes)


# ------------------------------------------------------------------------------------ on the workstation
def watch(path):
    """When a color was published, when it had come here, and when a picture showed it: a line each, s."""
    import rospy
    from visualization_msgs.msg import Marker
    rospy.init_node("eyes")
    lock, waiting, out = threading.Lock(), {}, open(path, "a", buffering=1)

    def on_marker(marker):
        with lock:
            waiting[marker.id] = (marker.header.stamp.to_sec(), time.time())

    def on_picture(message):
        seen, now = projector_latency.middle_code(message._buff), time.time()
        codes = projector_latency.CODES
        with lock:
            for number in [n for n in waiting if (seen - n % codes) % codes < codes // 2]:
                sent, came = waiting.pop(number)
                out.write(f"{number} {sent} {came} {now}\n")
    rospy.Subscriber(soak_work.COLOR, Marker, on_marker, tcp_nodelay=True)
    rospy.Subscriber("/projector_node/image", rospy.AnyMsg, on_picture, buff_size=1 << 22, tcp_nodelay=True)
    rospy.spin()


# ------------------------------------------------------------------------------------------ on the robot
class Colors(threading.Thread):
    """Shows colors, numbered and stamped, until stop()."""

    def __init__(self):
        super().__init__(daemon=True)
        import rospy
        from visualization_msgs.msg import Marker
        self.ends, self.sent = threading.Event(), 0
        self.marker = Marker(type=Marker.CUBE)
        self.marker.header.frame_id = "map"
        self.marker.pose.orientation.w = self.marker.color.a = 1
        self.marker.pose.position.z = soak_work.EYE_M / 2
        self.marker.scale.x = self.marker.scale.y = 0.15
        self.marker.scale.z = 0.01
        self.publisher = rospy.Publisher(soak_work.COLOR, Marker, queue_size=10, tcp_nodelay=True)

    def run(self):
        import rospy
        while not self.ends.wait(1 / COLORS_HZ):
            marker, code = self.marker, self.sent % projector_latency.CODES
            color = projector_latency.color_of(code)
            marker.color.r, marker.color.g, marker.color.b = (channel / 255 for channel in color)
            marker.id, marker.ns, marker.header.stamp = self.sent, "color", rospy.Time.now()
            marker.lifetime = rospy.Duration(1)
            self.publisher.publish(marker)
            self.sent += 1


def seen_since(world, begin):
    """[(s from publication to the workstation, s to the picture)]"""
    rows = [[float(word) for word in line.split()] for line in world.eyes.read_text().splitlines()]
    return [(came - sent, seen - sent) for _, sent, came, seen in rows if sent >= begin]


def record_and_look(world, link, cut_s):
    """Numbers recorded here and there, and colors seen there, for SECONDS."""
    import rospy
    from afterglow.srv import StartRecording, StopRecording
    from std_msgs.msg import Header
    numbers = rospy.Publisher(soak_work.COUNTED, Header, queue_size=100)
    begun = {}
    for node in ("/recorder_node", "/recorder_afar"):
        begun[node] = world.call(node + "/start_recording", StartRecording, name="live",
                                 topics=[soak_work.COUNTED, "/joint_states"]).behavior_id
    fetch_world.wait_until(lambda: numbers.get_num_connections() >= 2, "both recorders")
    colors, begin, cut_at = Colors(), time.time(), SECONDS / 3
    colors.start()
    start = time.monotonic()
    is_cut = False
    for number in range(SECONDS * NUMBERS_HZ):
        numbers.publish(Header(seq=number))
        since = time.monotonic() - start
        if cut_s and not is_cut and since > cut_at:
            link.say("down")
            threading.Timer(cut_s, link.say, ["up"]).start()
            is_cut = True
        time.sleep(max(0.0, start + (number + 1) / NUMBERS_HZ - time.monotonic()))
    colors.ends.set()
    time.sleep(3)  # what is under way arrives
    for node, store in (("/recorder_node", world.store), ("/recorder_afar", world.folder / "afar.db")):
        world.call(node + "/stop_recording", StopRecording, behavior_id=begun[node], outcome="success")
        command = [world.build / "bin/afterglow", "show", begun[node], "--json", "--store", store]
        shown = json.loads(subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, check=True).stdout)
        kept = sum(topic["count"] for topic in shown["topic_details"] if topic["topic"] == soak_work.COUNTED)
        where = "on the robot" if node == "/recorder_node" else "afar"
        print(f"  recorded {where}: {kept} of {SECONDS * NUMBERS_HZ} numbers")
    seen = seen_since(world, begin)
    ms = lambda values, part: 1000 * fetch_world.quantile(values, part)
    came, shown = [a for a, _ in seen], [b for _, b in seen]
    print(f"  colors: {len(seen)} of {colors.sent} seen afar; came after {ms(came, .5):.0f}, shown after "
          f"{ms(shown, .5):.0f} ms (p99 {ms(came, .99):.0f}, {ms(shown, .99):.0f}; last {ms(shown, 1):.0f})")
    numbers.unregister()


def replay(world, link, name, behavior, rhythm, told, cut_s):
    import rospy
    from afterglow.msg import ReplayActionGoal, ReplayActionResult
    results = []
    goals = rospy.Publisher("/replay/goal", ReplayActionGoal, queue_size=1)
    ear = rospy.Subscriber("/replay/result", ReplayActionResult, results.append, queue_size=10)
    fetch_world.wait_until(lambda: goals.get_num_connections() and ear.get_num_connections(), "player_node")
    told.take()
    goal = ReplayActionGoal()
    goal.goal.behavior = str(behavior)
    goals.publish(goal)
    if cut_s:
        fetch_world.wait_until(lambda: len(told.seen) > 20 or results, "the replay")
        link.say("down")
        time.sleep(cut_s)
        link.say("up")
    fetch_world.wait_until(lambda: results, "the replay's end", 120)
    result, deadline = results[0], time.monotonic() + LATEST_S
    while len(told.seen) < len(rhythm) and time.monotonic() < deadline:
        time.sleep(0.1)  # each connection comes back in its own time
    line = f"  replay, {name}: " + ("to its end" if result.result.completed else "stopped: " + result.status.text)
    seen = told.take()
    common = sorted(set(seen) & set(rhythm))
    if rhythm and common:
        late = [(seen[i] - seen[common[0]]) - (rhythm[i] - rhythm[common[0]]) for i in common]
        ms = [1000 * fetch_world.quantile([abs(value) for value in late], part) for part in (.5, .99)]
        line += (f"; {len(seen)} of {len(rhythm)} marks heard on the robot, rhythm off by {ms[0]:.0f} ms "
                 f"(p99 {ms[1]:.0f})")
    print(line, flush=True)
    goals.unregister()
    ear.unregister()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    fetch_world.add_build_option(parser)
    parser.add_argument("--delay", type=float, default=50, help="ms, each way")
    parser.add_argument("--loss", type=float, default=1, help="percent, each way")
    parser.add_argument("--cut", type=float, default=5, help="s")
    parser.add_argument("--eyes", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.eyes:
        return watch(options.eyes)
    folder = Path(tempfile.mkdtemp(prefix="two_machines_"))
    with Link(options.delay, options.loss) as link, TwoMachines(options.build, folder, HERE) as world:
        world.set_up()
        told = soak_work.Told()
        fetch_world.wait_until(world.eyes.exists, "the workstation")
        light = soak_work.teach(world, "told", [soak_work.TOLD, soak_work.SPEECH],
                                lambda: soak_work.tell(soak_work.TOLD_S, told))
        rhythm = told.take()
        reach = soak_work.teach(world, "reach", [fetch_world.ARM + "/goal", "/cmd_vel"], soak_work.reach)
        for cut_s in (0, options.cut):
            print(f"{options.delay:g} ms and {options.loss:g} % lost each way" +
                  (f", cut for {cut_s:g} s" if cut_s else ""), flush=True)
            record_and_look(world, link, cut_s)
            replay(world, link, "light and speech", light, rhythm, told, cut_s)
            replay(world, link, "arm and base", reach, {}, told, 0)
    print(f"what the nodes said: {folder}/nodes.log")
    return 0


if __name__ == "__main__":
    sys.exit(main())
