#!/usr/bin/env python3
"""How far light lies from where it belongs on the floor while the base drives.

    tests/bench/moving_light.py [--build build] [--projector-ms 40] [--latency-ms 0 40] [--seconds 16]

A fake Fetch drives over a floor of lit squares at 0.5 m/s, turns at 0.5 rad/s, does both, drives curves
to and fro, and starts and stops in between; its projector shows each picture so long after it is handed
over as --projector-ms says. For each --latency-ms of the configuration, without and with its `base` (what
its commands announce), and for each way the robot knows where it is (exactly; slipping wheels that a
localization corrects on the way, by centimeters), prints how far the squares' centers then lie from where
they belong, in mm: median, 95th percentile, largest, and the same where the base moves steadily, by the
robot's true pose of that moment and the referee's lens (tests/referee/procam_sim.py); and what /diagnostics
says of it. Where the robot is wrong about itself, so is light: "by tf" is how far it lies from where the
robot itself, as it knows afterwards, had it belong. Needs the Python of ROS.
"""
import argparse
import collections
import math
import multiprocessing
import struct
import sys
import tempfile
import threading
import time
from pathlib import Path

import cv2
import numpy as np

from fetch_world import SOURCE, World, add_build_option, green, link_to_base, quantile, wait_until, write_lens

sys.path.insert(0, str(SOURCE / 'tests/referee'))
import procam_sim as sim  # noqa: E402

WIDTH, HEIGHT, FOCAL = 640, 400, 640.0
SPACING, SIDE, REACH = 0.4, 0.04, 6.0  # m: of the squares, and how far they go
PERIOD_S = 0.02
ROBOTS = {
    'exact': dict(linear_scale=1, angular_scale=1, slip=0),
    'corrected': dict(localization_error=0.01, localization_yaw_error=math.radians(0.3)),
}
LENS = sim.Lens(dict(width=WIDTH, height=HEIGHT, K=[FOCAL, 0, WIDTH / 2, 0, FOCAL, HEIGHT / 2, 0, 0, 1]))


def base_to_projector():
    """1.2 m high, looking ahead and down by 50 degrees."""
    return sim.look_at(np.array([0.2, 0, 1.2]), np.array([0.2 + 1.2 / math.tan(math.radians(50)), 0, 0]))


def configuration(folder, latency_ms, has_commands):
    write_lens(folder, WIDTH, HEIGHT, FOCAL)
    path = folder / 'config.yaml'
    path.write_text(f'''fixed_frame: map
projector: {{camera_info: lens.yaml, frame: projector, latency_ms: {latency_ms}}}
layers:
  - {{topic: /marker, type: visualization_msgs/Marker}}
{'base: {commands: /cmd_vel, linear_acceleration: 0.75, angular_acceleration: 3}' if has_commands else ''}
''')
    return path


def velocities(seconds):
    """(m/s, rad/s) every PERIOD_S: the base itself limits how fast they change."""
    def hold(forward, left, part):
        return [(forward, left)] * int(part * seconds / PERIOD_S)
    weave = [(0.5, 0.5 * math.cos(2 * math.pi * i * PERIOD_S / 4)) for i in range(int(seconds / 4 / PERIOD_S))]
    return (hold(0, 0, 0.05) + hold(0.5, 0, 0.15) + hold(0, 0, 0.05) + hold(0, 0.5, 0.15) + hold(0.5, 0.5, 0.15) +
            weave + hold(-0.5, 0, 0.1) + hold(0, -0.5, 0.1))


class Witness:
    """True poses, poses in tf, and pictures with the moment at which they were handed over."""

    def __init__(self):
        import rospy
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import PoseStamped
        from tf2_msgs.msg import TFMessage
        self.truth, self.pictures, self.told = [], [], []
        self.links = collections.defaultdict(list)
        self.lock = threading.Lock()
        self.kept = [
            rospy.Subscriber('/fake_fetch/true_pose', PoseStamped, self.on_pose, tcp_nodelay=True),
            rospy.Subscriber('/tf', TFMessage, self.on_tf, tcp_nodelay=True),
            rospy.Subscriber('/diagnostics', DiagnosticArray, self.on_diagnostics),
            rospy.Subscriber('/projector_node/image', rospy.AnyMsg, self.on_picture, buff_size=1 << 23,
                             tcp_nodelay=True)]

    def on_pose(self, message):
        p, q = message.pose.position, message.pose.orientation
        self.truth.append((message.header.stamp.to_sec(), p.x, p.y, 2 * math.atan2(q.z, q.w)))

    def on_tf(self, message):
        for link in message.transforms:
            t, q = link.transform.translation, link.transform.rotation
            self.links[link.child_frame_id].append(
                (link.header.stamp.to_sec(), t.x, t.y, 2 * math.atan2(q.z, q.w)))

    def on_diagnostics(self, message):
        for status in message.status:
            for value in status.values:
                if value.key == 'light may be off':
                    self.told.append(value.value)

    def on_picture(self, message):
        now = time.time()
        seconds, nanoseconds = struct.unpack_from('<II', message._buff, 4)
        self.pictures.append((now, seconds + nanoseconds / 1e9, green(message, WIDTH, HEIGHT).copy()))


def track(poses):
    """Of (time, x, y, yaw): an array whose yaw goes on beyond half a turn."""
    poses = np.array(list(poses))
    poses[:, 3] = np.unwrap(poses[:, 3])
    return poses


def at(poses, when):
    """Interpolated; None beyond them."""
    if not poses[0, 0] <= when <= poses[-1, 0]:
        return None
    return [np.interp(when, poses[:, 0], poses[:, i]) for i in (1, 2, 3)]


def is_steady(poses, when):
    """Whether the base neither sped up nor slowed down in the last 0.15 s."""
    a, b, c = (at(poses, when - before) for before in (0.15, 0.075, 0))
    if a is None:
        return False
    speed = [math.dist(p[:2], q[:2]) / 0.075 for p, q in ((a, b), (b, c))]
    turn = [(q[2] - p[2]) / 0.075 for p, q in ((a, b), (b, c))]
    return abs(speed[1] - speed[0]) < 0.03 and abs(turn[1] - turn[0]) < 0.05 and speed[1] + abs(turn[1]) > 0.1


def matrix(pose):
    x, y, yaw = pose
    return sim.pose(sim.euler(0, 0, yaw), [x, y, 0])


def centers(picture):
    """Of the lit squares that lie wholly in the picture, px."""
    count, _, stats, _ = cv2.connectedComponentsWithStats((picture > 40).astype(np.uint8))
    for x, y, w, h, area in stats[1:count]:
        if x <= 1 or y <= 1 or x + w >= WIDTH - 1 or y + h >= HEIGHT - 1 or area < 30:
            continue
        part = picture[y - 1:y + h + 1, x - 1:x + w + 1].astype(float)
        rows, columns = np.mgrid[y - 1:y + h + 1, x - 1:x + w + 1]
        yield (part * columns).sum() / part.sum(), (part * rows).sum() / part.sum()


def errors_mm(picture, T_map_projector):
    pixels = np.array(list(centers(picture)))
    if not len(pixels):
        return []
    rays = LENS.rays(pixels[:, 0], pixels[:, 1]) @ T_map_projector[:3, :3].T
    eye = T_map_projector[:3, 3]
    lands = eye + rays * (-eye[2] / rays[:, 2])[:, None]
    meant = np.round(lands[:, :2] / SPACING) * SPACING
    return list(1000 * np.linalg.norm(lands[:, :2] - meant, axis=1))


def show_floor():
    import rospy
    from geometry_msgs.msg import Point
    from tf2_msgs.msg import TFMessage
    from visualization_msgs.msg import Marker
    marker = Marker(type=Marker.CUBE_LIST)
    marker.header.frame_id = 'map'
    marker.pose.orientation.w = marker.color.g = marker.color.a = 1
    marker.scale.x = marker.scale.y = SIDE
    marker.scale.z = 0.0001
    count = int(REACH / SPACING)
    marker.points = [Point(i * SPACING, j * SPACING, 0) for i in range(-count, count + 1)
                     for j in range(-count, count + 1)]
    floor = rospy.Publisher('/marker', Marker, latch=True, queue_size=1)
    tf = rospy.Publisher('/tf_static', TFMessage, latch=True, queue_size=1)
    floor.publish(marker)
    tf.publish(TFMessage([link_to_base('projector', base_to_projector())]))
    return floor, tf


def drive(seconds):
    import rospy
    from geometry_msgs.msg import Twist
    publisher = rospy.Publisher('/cmd_vel', Twist, queue_size=10)
    wait_until(lambda: publisher.get_num_connections() > 0, 'the base')
    begin = time.monotonic()
    for i, (forward, left) in enumerate(velocities(seconds)):
        time.sleep(max(0, begin + i * PERIOD_S - time.monotonic()))
        message = Twist()
        message.linear.x, message.angular.z = forward, left
        publisher.publish(message)


def measure(build, latency_ms, has_commands, projector_ms, seconds, robot, queue):
    with tempfile.TemporaryDirectory() as name, World(build, name) as world:
        world.node('fake_fetch_node', scan='false', **robot)
        # The model's own turret has a static frame of another name.
        witness, kept = Witness(), show_floor()
        world.node('projector_node', config=configuration(Path(name), latency_ms, has_commands), window='false')
        wait_until(lambda: witness.truth and any((p > 40).any() for _, _, p in witness.pictures[-3:]), 'light')
        del kept
        begin = time.time()
        drive(seconds)
        time.sleep(0.3)
        errors, steady, by_tf = [], [], []
        truth = track(witness.truth)
        links = [track(witness.links[frame]) for frame in ('odom', 'base_link')]
        for handed, stamp, picture in list(witness.pictures):
            when = handed + projector_ms / 1000
            true = at(truth, when) if handed > begin else None
            if true is None:
                continue
            off = errors_mm(picture, matrix(true) @ base_to_projector())
            errors += off
            steady += off if is_steady(truth, when) else []
            known = [at(link, when) for link in links]
            if None not in known:
                by_tf += errors_mm(picture, matrix(known[0]) @ matrix(known[1]) @ base_to_projector())
        queue.put((errors, steady, by_tf, witness.told))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_build_option(parser)
    parser.add_argument('--projector-ms', type=float, default=40)
    parser.add_argument('--latency-ms', type=float, nargs='+', default=[0, 40])
    parser.add_argument('--seconds', type=float, default=16)
    parser.add_argument('--limit-mm', type=float, default=5,
                        help='of the exact robot, p95, if latency_ms is right and commands are known')
    arguments = parser.parse_args()
    is_good = True
    for name, robot in ROBOTS.items():
        for latency, has_commands in [(ms, known) for ms in arguments.latency_ms
                                      for known in ([False, True] if ms else [False])]:
            queue = multiprocessing.Queue()
            process = multiprocessing.Process(target=measure, args=(
                arguments.build, latency, has_commands, arguments.projector_ms, arguments.seconds, robot, queue))
            process.start()
            errors, steady, by_tf, told = queue.get(timeout=60 + 2 * arguments.seconds)
            process.join()
            print(f'{name:<9} latency_ms {latency:3.0f}{" and commands" if has_commands else "":13}: {len(errors):6} squares, off by p50 '
                  f'{quantile(errors, 0.5):5.1f}, p95 {quantile(errors, 0.95):5.1f}, max {max(errors):6.1f} mm; '
                  f'steady p50 {quantile(steady, 0.5):5.1f}, p95 {quantile(steady, 0.95):5.1f}; '
                  f'by tf p50 {quantile(by_tf, 0.5):5.1f}, p95 {quantile(by_tf, 0.95):5.1f}; '
                  f'told: {told[len(told) // 2] if told else "nothing"}', flush=True)
            if name == 'exact' and latency == arguments.projector_ms and has_commands:
                is_good = is_good and quantile(errors, 0.95) <= arguments.limit_mm
    return 0 if is_good else 1


if __name__ == '__main__':
    sys.exit(main())
