"""What tests/bench/soak has the nodes do at once: project, record, replay; and what is lost."""
import json
import math
import subprocess
import threading
import time
from pathlib import Path

import fetch_world
import projector_latency
from parts import trend

TUCKED = [0.0, 1.32, 1.4, -0.2, 1.72, 0.0, 1.66, 0.0]
RAISED = [0.1, 1.0, 1.2, -0.2, 1.6, 0.0, 1.5, 0.0]
TOLD_HZ, TOLD_S, COUNTED_HZ = 20, 10, 50
RECORDED_S = 20
TURN, TURN_S = 0.4, 1.5  # rad/s and s, there and back
REPLAY_PATIENCE_S = 120
SEEN_WITHIN_S = 2.0
COLOR, TOLD, COUNTED, SPEECH = "/soak/color", "/soak/told", "/soak/count", "/robotsound"
LIVE = ["/soak/cloud", "/soak/markers", "/soak/path", "/base_scan", COUNTED]
LIMITS = ["/soak/cloud max_hz=2"]
KEPT = "keep"  # a tag of behaviors that make no room
EYE_M = 2.0

CONFIGURATION = """fixed_frame: map
projector: {{camera_info: lens.yaml, frame: projector}}
surfaces:
  floor: {{frame: map, polygon: [[-4, -4], [4, -4], [4, 4], [-4, 4]]}}
layers:
  - {{topic: /soak/cloud, type: sensor_msgs/PointCloud2, style: points, size: 3, color: rgb8}}
  - {{topic: /base_scan, type: sensor_msgs/LaserScan, style: spheres, size: 0.05, surface: floor,
     placement: drape}}
  - {{topic: /soak/path, type: nav_msgs/Path}}
  - {{topic: /soak/markers, type: visualization_msgs/MarkerArray}}
  - {{topic: {told}, type: visualization_msgs/Marker}}
  - {{topic: {color}, type: visualization_msgs/Marker}}
"""


def configuration(folder, size):
    """projector_node's, which looks straight down on the map's origin; returns its path."""
    width, height = (int(number) for number in size.split("x"))
    projector_latency.write_configuration(folder, width, height, 0)
    path = Path(folder) / "projector.yaml"
    path.write_text(CONFIGURATION.format(told=TOLD, color=COLOR))
    return path


class Log:
    """What happened, with the minute it happened at; from any thread."""
    def __init__(self):
        self.lock = threading.Lock()
        self.begin = time.monotonic()
        self.kept = {}
        self.troubles = []

    def minute(self):
        return (time.monotonic() - self.begin) / 60

    def add(self, what, value):
        with self.lock:
            self.kept.setdefault(what, []).append((self.minute(), value))

    def of(self, what):
        with self.lock:
            return list(self.kept.get(what, []))

    def trouble(self, words):
        with self.lock:
            self.troubles.append((self.minute(), words))


class Worker(threading.Thread):
    """Does its turn until stop(); a turn that fails is a trouble, and the next follows."""
    def __init__(self, log):
        super().__init__(daemon=True)
        self.log, self.ends = log, threading.Event()

    def run(self):
        while not self.ends.is_set():
            try:
                self.turn()
            except Exception as error:  # the soak goes on and tells it
                self.log.trouble(f"{type(self).__name__.lower()}: {error}")
                self.ends.wait(2)

    def stop(self, patience_s):
        self.ends.set()
        self.join(patience_s)
        if self.is_alive():
            self.log.trouble(f"{type(self).__name__.lower()}: not over after {patience_s} s")


# -------------------------------------------------------------------------------------- projecting
class Watch(projector_latency.Watch):
    def take(self):
        """Since the last time: latencies in ms, pictures, colors unseen for SEEN_WITHIN_S."""
        now = time.monotonic()
        with self.lock:
            late = [code for code, at in self.waiting.items() if now - at > SEEN_WITHIN_S]
            for code in late:
                del self.waiting[code]
            latencies, self.latencies = [1000 * value for value in self.latencies], []
            pictures, self.pictures = self.pictures, 0
        return latencies, pictures, len(late)


class Projecting(Worker):
    """Shows ten colors a second, awaits each in the picture's middle; notes when pictures come."""
    def __init__(self, log):
        super().__init__(log)
        import rospy
        from sensor_msgs.msg import CameraInfo
        from visualization_msgs.msg import Marker
        self.watch, self.number, self.shown = Watch(), 0, 0
        self.intervals, self.last = [], None
        self.lock = threading.Lock()
        self.publisher = rospy.Publisher(COLOR, Marker, queue_size=1, tcp_nodelay=True)
        self.marker = Marker(type=Marker.CUBE)
        self.marker.header.frame_id = "map"
        self.marker.pose.position.z = EYE_M / 2  # between the eye and all else
        self.marker.pose.orientation.w = self.marker.color.a = 1
        self.marker.scale.x = self.marker.scale.y = 0.15
        self.marker.scale.z = 0.01
        rospy.Subscriber("/projector_node/image",
                         rospy.AnyMsg,
                         self.watch.see,
                         buff_size=1 << 24,
                         tcp_nodelay=True)
        rospy.Subscriber("/projector_node/camera_info",
                         CameraInfo,
                         self.on_picture,
                         tcp_nodelay=True)

    def on_picture(self, _):
        now = time.monotonic()
        with self.lock:
            if self.last is not None:
                self.intervals.append(1000 * (now - self.last))
            self.last = now

    def is_seen(self):
        with self.watch.lock:
            return len(self.watch.latencies) > 10

    def take_intervals(self):
        with self.lock:
            taken, self.intervals = self.intervals, []
        return taken

    def send(self, code):
        color = self.marker.color
        color.r, color.g, color.b = (channel / 255 for channel in projector_latency.color_of(code))
        self.publisher.publish(self.marker)

    def turn(self):
        self.watch.publish(self.number % projector_latency.CODES, self.send)
        self.number += 1
        self.ends.wait(0.1)


# --------------------------------------------------------------------------------------- recording
class Recording(Worker):
    """A behavior after the other; of a numbered topic all has to be there that was sent."""
    def __init__(self, log, world):
        super().__init__(log)
        import rospy
        from std_msgs.msg import Header
        self.world, self.published, self.recorded, self.dropped = world, 0, 0, 0
        self.publisher = rospy.Publisher(COUNTED, Header, queue_size=1000)

    def turn(self):
        from afterglow.srv import StartRecording, StopRecording
        began = time.monotonic()
        behavior = self.world.call("/recorder_node/start_recording",
                                   StartRecording,
                                   name="live",
                                   topics=LIVE,
                                   limits=LIMITS).behavior_id
        self.log.add("start_ms", 1000 * (time.monotonic() - began))
        sent = self.send_numbers()
        time.sleep(0.5)  # what is under way arrives
        stopped = self.world.call("/recorder_node/stop_recording",
                                  StopRecording,
                                  behavior_id=behavior,
                                  outcome="success")
        self.judge(behavior, sent, stopped)

    def send_numbers(self):
        from std_msgs.msg import Header
        begin, sent = time.monotonic(), 0
        while sent < RECORDED_S * COUNTED_HZ and not self.ends.is_set():
            self.publisher.publish(Header(seq=sent))
            sent += 1
            time.sleep(max(0.0, begin + sent / COUNTED_HZ - time.monotonic()))
        return sent

    def judge(self, behavior, sent, stopped):
        kept = recorded_count(self.world, behavior, COUNTED)
        self.published, self.recorded = self.published + sent, self.recorded + kept
        self.dropped += stopped.dropped
        self.log.add("lost", sent - kept)
        self.log.add("behavior_messages", stopped.messages)
        if kept != sent or stopped.dropped:
            self.log.trouble(f"recording: {kept} of {sent} are in behavior {behavior}, "
                             f"{stopped.dropped} were dropped")


def recorded_count(world, behavior, topic):
    command = [
        str(world.build / "bin/afterglow"), "show",
        str(behavior), "--json", "--store",
        str(world.store)
    ]
    shown = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True,
                           timeout=60).stdout
    return sum(
        entry["count"] for entry in json.loads(shown)["topic_details"] if entry["topic"] == topic)


# --------------------------------------------------------------------------------------- replaying
class Told:
    """When the markers of a told behavior arrive, by their number."""
    def __init__(self):
        import rospy
        from visualization_msgs.msg import Marker
        self.lock, self.seen = threading.Lock(), {}
        rospy.Subscriber(TOLD, Marker, self.on_marker, tcp_nodelay=True)

    def on_marker(self, message):
        if message.action != message.ADD:
            return
        with self.lock:
            self.seen.setdefault(message.id, time.monotonic())

    def take(self):
        with self.lock:
            seen, self.seen = self.seen, {}
        return seen


def tell(seconds, told):
    """Markers at TOLD_HZ and some words, so long."""
    import rospy
    from sound_play.msg import SoundRequest
    from visualization_msgs.msg import Marker
    light = rospy.Publisher(TOLD, Marker, queue_size=100, tcp_nodelay=True)
    speech = rospy.Publisher(SPEECH, SoundRequest, queue_size=10)
    fetch_world.wait_until(
        lambda: light.get_num_connections() >= 3 and speech.get_num_connections() >= 1,
        "projector, recorder and witness")
    told.take()
    begin = time.monotonic()
    for number in range(int(seconds * TOLD_HZ)):
        marker = Marker(type=Marker.CYLINDER,
                        id=number,
                        action=Marker.ADD,
                        lifetime=rospy.Duration(2))
        marker.header.frame_id, marker.header.stamp = "map", rospy.Time.now()
        marker.pose.position.x, marker.pose.position.y = math.cos(number / 20), -0.7
        marker.pose.orientation.w = marker.color.g = marker.color.a = 1
        marker.scale.x = marker.scale.y = marker.scale.z = 0.1
        light.publish(marker)
        if number % (4 * TOLD_HZ) == TOLD_HZ:
            speech.publish(
                SoundRequest(sound=SoundRequest.SAY,
                             command=SoundRequest.PLAY_ONCE,
                             volume=1,
                             arg=f"this is number {number}"))
        time.sleep(max(0.0, begin + (number + 1) / TOLD_HZ - time.monotonic()))
    time.sleep(0.5)
    light.unregister()
    speech.unregister()


def turn_there_and_back(wheels):
    from geometry_msgs.msg import Twist
    for speed in [0.0] * 10 + [TURN] * int(TURN_S * 20) + [0.0] * 10 + [-TURN] * int(
            TURN_S * 20) + [0.0] * 10:
        twist = Twist()
        twist.angular.z = speed
        wheels.publish(twist)
        time.sleep(0.05)


def reach():
    """Raises the arm and tucks it again, turns the base and turns it back."""
    import rospy
    from geometry_msgs.msg import Twist
    wheels = rospy.Publisher("/cmd_vel", Twist, queue_size=10)
    arm = fetch_world.Arm()
    fetch_world.wait_until(
        lambda: arm.publisher.get_num_connections() >= 2 and wheels.get_num_connections() >= 2,
        "robot and recorder")
    time.sleep(1)
    arm.go([(4, RAISED), (8, TUCKED)])
    turn_there_and_back(wheels)
    time.sleep(1)
    wheels.unregister()
    arm.publisher.unregister()


def teach(world, name, topics, perform):
    """A behavior that the store's retention keeps."""
    from afterglow.srv import StartRecording, StopRecording
    behavior = world.call("/recorder_node/start_recording",
                          StartRecording,
                          name=name,
                          topics=topics,
                          tags=[KEPT]).behavior_id
    perform()
    world.call("/recorder_node/stop_recording",
               StopRecording,
               behavior_id=behavior,
               outcome="success")
    return behavior


class Replaying(Worker):
    """One replay after the other: light and speech, then the body, and so on."""
    def __init__(self, log, world, behaviors, told, rhythm):
        super().__init__(log)
        import rospy
        from afterglow.msg import ReplayActionGoal, ReplayActionResult
        self.world, self.behaviors, self.told, self.rhythm = world, behaviors, told, rhythm
        self.next, self.results = 0, {}
        self.begun, self.completed = {}, {}  # by kind
        self.goals = rospy.Publisher("/replay/goal", ReplayActionGoal, queue_size=10)
        rospy.Subscriber("/replay/result", ReplayActionResult, self.on_result, queue_size=10)

    def on_result(self, message):
        self.results[message.status.goal_id.id] = message

    def turn(self):
        kind, behavior = self.behaviors[self.next % len(self.behaviors)]
        self.next += 1
        fetch_world.wait_until(lambda: self.goals.get_num_connections() > 0, "player_node")
        self.told.take()
        result = self.play(behavior)
        self.begun[kind] = self.begun.get(kind, 0) + 1
        self.completed[kind] = self.completed.get(kind, 0) + result.result.completed
        if result.result.completed:
            self.note(kind, json.loads(result.result.report))
        else:
            self.log.trouble(f"replaying: the {kind} was stopped: {result.status.text}")
            self.put_back()

    def put_back(self):
        """What stops a moving robot, a busy machine too, leaves it where it was."""
        from std_srvs.srv import Trigger
        self.world.call("/fake_fetch/reset", Trigger)
        self.ends.wait(2)

    def play(self, behavior):
        import rospy
        from afterglow.msg import ReplayActionGoal
        goal = ReplayActionGoal()
        goal.goal_id.id = f"soak-{self.next}"
        goal.goal_id.stamp = goal.header.stamp = rospy.Time.now()
        goal.goal.behavior = str(behavior)
        self.goals.publish(goal)
        fetch_world.wait_until(lambda: goal.goal_id.id in self.results, "the replay's end",
                               REPLAY_PATIENCE_S)
        return self.results.pop(goal.goal_id.id)

    def note(self, kind, report):
        late = [
            topic["lateness_ms"]["p99"]
            for topic in report["topics"].values()
            if topic.get("lateness_ms")
        ]
        self.log.add(f"{kind}_late_ms", max(late, default=None))
        if kind != "light":
            base = report.get("body", {}).get("base", {})
            self.log.add("base_off_cm", 100 * base["distance_m"] if "distance_m" in base else None)
            return
        seen = self.told.take()
        self.log.add("told_lost", len(self.rhythm) - len(seen))
        common = sorted(set(seen) & set(self.rhythm))
        errors = [
            1000 * ((seen[i] - seen[common[0]]) - (self.rhythm[i] - self.rhythm[common[0]]))
            for i in common
        ]
        self.log.add("drift_ms", trend.schedule_drift(errors, TOLD_HZ))
