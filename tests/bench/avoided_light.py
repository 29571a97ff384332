#!/usr/bin/env python3
"""How much light hits a person or the robot's own arm although it should not, and how much is dark in vain.

    tests/bench/avoided_light.py [--build build] [--seconds 10] [--sensor-ms 60] [--projector-ms 40]
                                 [--hertz 15] [--pictures DIR]

A fake Fetch's projector lights the floor before it all white. In turn: its arm stands still in the light, its
arm swings through it, a person walks through it at 1 m/s, to and fro. A depth camera (128 x 96 rays, so many
clouds a second, each so long after its stamp, noise 5 mm) sees them; each picture is shown so long after it
is handed over as --projector-ms says. At that moment every ray of the projector's is cast into the true room:
it hits the robot or the person higher than 0.1 m over the floor, or the floor. Prints, for `avoid` left out,
for one that knows of no delay (latency_ms: 0, speed: 0) and for one that does (the projector's, 1.6 m/s),

  lit     of the rays that hit a person or the robot, the share that was lit, and the 95th percentile of the
          pictures' shares
  dark    of the rays that hit the floor, the share that was dark

and last, of a post that comes and goes, the time from the stamp of the first cloud that shows it to the first
picture handed over that is dark there (--sensor-ms counts, --projector-ms does not). The robot and the room
are cast here, in numpy, by the robot's description and its true joint states; poses by the referee's
conventions (tests/referee/procam_sim.py). Exits with 1 if a delay that is known lights more than --limit.
Needs the Python of ROS.
"""
import argparse
import collections
import math
import multiprocessing
import sys
import tempfile
import threading
import time
import xml.etree.ElementTree as ET
from pathlib import Path
from queue import Empty

import cv2
import numpy as np

from fetch_world import SOURCE, Arm, World, add_build_option, green, link_to_base, quantile, wait_until, write_lens

sys.path.insert(0, str(SOURCE / 'tests/referee'))
import procam_sim as sim  # noqa: E402

WIDTH, HEIGHT, FOCAL = 640, 400, 700.0
STEP = 8  # px between the rays that are judged
HEIGHT_M = 0.1
LENS = sim.Lens(dict(width=WIDTH, height=HEIGHT, K=[FOCAL, 0, WIDTH / 2, 0, FOCAL, HEIGHT / 2, 0, 0, 1]))
CAMERA = sim.Lens(dict(width=128, height=96, K=[64, 0, 63.5, 0, 64, 47.5, 0, 0, 1]))  # 90 x 74 degrees
T_BASE_CAMERA = sim.look_at(np.array([0.1, 0.25, 1.5]), np.array([1.5, 0, 0.4]))
LIGHT_Y = -0.38  # m, of the middle of the light
TILT = 0.75  # rad, of the projector: its light falls on the floor 1 to 2.5 m ahead
TUCKED = [0.0, 1.32, 1.4, -0.2, 1.72, 0.0, 1.66, 0.0]
STILL, LEFT, RIGHT = ([0.1, pan, 0.1, 0.0, 0.3, 0.0, 0.4, 0.0] for pan in (-0.4, 0.2, -0.8))
SWING_S = 1.2
WALK_X, WALK_Y, WALK_SPEED = 1.55, 1.2, 1.0  # m; m to both sides of the light; m/s
CONFIGURATIONS = {'left out': None, 'no delay known': (0, 0), 'delay known': (None, 1.6)}


# ------------------------------------------------------------------------------------------- the truth
def numbers(text):
    return [float(word) for word in text.split()]


def origin(element):
    found = element.find('origin')
    if found is None:
        return np.eye(4)
    turn = np.eye(3)
    for axis, angle in zip(np.eye(3), numbers(found.get('rpy', '0 0 0'))):  # about fixed axes
        turn = cv2.Rodrigues(axis * angle)[0] @ turn
    return sim.pose(turn, numbers(found.get('xyz', '0 0 0')))


class Robot:
    """Boxes, cylinders and spheres on links, from the description."""

    def __init__(self, path):
        root = ET.parse(path).getroot()
        self.joints = {j.find('child').get('link'): j for j in root.findall('joint')}
        self.shapes = []  # link, kind, size, T_link_shape
        for link in root.findall('link'):
            for visual in link.findall('visual'):
                shape = visual.find('geometry')[0]
                size = {'box': lambda s: numbers(s.get('size')),
                        'cylinder': lambda s: [float(s.get('radius')), float(s.get('length'))],
                        'sphere': lambda s: [float(s.get('radius'))]}[shape.tag](shape)
                self.shapes.append((link.get('name'), shape.tag, size, origin(visual)))

    def pose(self, link, positions, known):
        if link in known:
            return known[link]
        if link not in self.joints:
            return np.eye(4)
        joint = self.joints[link]
        T = origin(joint)
        axis = np.array(numbers(joint.find('axis').get('xyz'))) if joint.find('axis') is not None else np.array([1, 0, 0])
        q = positions.get(joint.get('name'), 0.0)
        if joint.get('type') in ('revolute', 'continuous'):
            T = T @ sim.pose(cv2.Rodrigues(axis * q)[0], [0, 0, 0])
        elif joint.get('type') == 'prismatic':
            T = T @ sim.pose(np.eye(3), axis * q)
        known[link] = self.pose(joint.find('parent').get('link'), positions, known) @ T
        return known[link]

    def solids(self, positions, without=()):
        known = {}
        return [(kind, size, self.pose(link, positions, known) @ T)
                for link, kind, size, T in self.shapes if link not in without]


def upright(x, y, radius, low, high):
    return 'cylinder', [radius, high - low], sim.pose(np.eye(3), [x, y, (low + high) / 2])


def person(y):
    """Legs, body and head of somebody of 1.75 m."""
    return [upright(WALK_X, y - 0.1, 0.07, 0, 0.8), upright(WALK_X, y + 0.1, 0.07, 0, 0.8),
            upright(WALK_X, y, 0.19, 0.8, 1.45), ('sphere', [0.13], sim.pose(np.eye(3), [WALK_X, y, 1.62]))]


def walker(when):
    """Where the person is, to and fro."""
    way = (when * WALK_SPEED) % (4 * WALK_Y)
    return (way - WALK_Y if way < 2 * WALK_Y else 3 * WALK_Y - way) + LIGHT_Y


def cast(eye, rays, solids):
    """How far along each ray the first solid is; infinite: none."""
    nearest = np.full(len(rays), np.inf)
    lengths = np.linalg.norm(rays, axis=1)
    for kind, size, T in solids:
        reach = {'box': lambda: np.linalg.norm(size) / 2, 'sphere': lambda: size[0],
                 'cylinder': lambda: math.hypot(size[0], size[1] / 2)}[kind]()
        to = T[:3, 3] - eye
        along = rays @ to / lengths
        close = np.flatnonzero((to @ to - along ** 2 < reach ** 2) & (along > -reach))
        if not len(close):
            continue
        R = T[:3, :3]
        o, d = -to @ R, rays[close] @ R  # in the solid's frame
        with np.errstate(divide='ignore', invalid='ignore'):
            if kind == 'box':
                half = np.array(size) / 2
                a, b = (-half - o) / d, (half - o) / d
                enters, leaves = np.minimum(a, b).max(1), np.maximum(a, b).min(1)
            else:
                columns = slice(0, 3 if kind == 'sphere' else 2)
                A = (d[:, columns] ** 2).sum(1)
                B = d[:, columns] @ o[columns]
                C = (o[columns] ** 2).sum() - size[0] ** 2
                root = np.sqrt(B * B - A * C)
                enters, leaves = (-B - root) / A, (-B + root) / A
                if kind == 'cylinder':
                    a, b = (-size[1] / 2 - o[2]) / d[:, 2], (size[1] / 2 - o[2]) / d[:, 2]
                    enters, leaves = np.maximum(enters, np.minimum(a, b)), np.minimum(leaves, np.maximum(a, b))
        hit = (enters < leaves) & (enters > 1e-6)
        nearest[close[hit]] = np.minimum(nearest[close[hit]], enters[hit])
    return nearest


class Joints:
    """The true positions of all joints, over time."""

    def __init__(self):
        import rospy
        from sensor_msgs.msg import JointState
        self.tracks = collections.defaultdict(list)
        self.lock = threading.Lock()
        self.kept = rospy.Subscriber('/joint_states', JointState, self.on_state, tcp_nodelay=True)

    def on_state(self, message):
        with self.lock:
            for name, position in zip(message.name, message.position):
                self.tracks[name].append((message.header.stamp.to_sec(), position))

    def at(self, when):
        with self.lock:
            tails = {name: track[-200:] if time.time() - when < 1 else track for name, track in self.tracks.items()}
            return {name: np.interp(when, *zip(*track)) for name, track in tails.items()}


# --------------------------------------------------------------------------------------------- sensing
class DepthCamera:
    """Clouds of the true room, in a thread of its own."""

    def __init__(self, robot, joints, things, hertz, sensor_s):
        import rospy
        from sensor_msgs.msg import PointCloud2
        self.robot, self.joints, self.things = robot, joints, things
        self.period_s, self.sensor_s = 1 / hertz, sensor_s
        self.publisher = rospy.Publisher('/depth/points', PointCloud2, queue_size=1, tcp_nodelay=True)
        u, v = np.meshgrid(np.arange(CAMERA.w), np.arange(CAMERA.h))
        self.rays = CAMERA.rays(u.ravel().astype(float), v.ravel().astype(float))
        self.random = np.random.default_rng(1)
        self.stamps = []
        self.is_on = True
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self):
        due = time.time()
        while self.is_on:
            due = max(due + self.period_s, time.time())
            time.sleep(max(0, due + self.sensor_s / 2 - time.time()))  # joint states of then have come
            message = self.see(due)
            time.sleep(max(0, due + self.sensor_s - time.time()))
            self.publisher.publish(message)
            self.stamps.append(due)

    def see(self, when):
        import rospy
        from sensor_msgs.msg import PointCloud2, PointField
        rays, eye = self.rays @ T_BASE_CAMERA[:3, :3].T, T_BASE_CAMERA[:3, 3]
        way = cast(eye, rays, self.robot.solids(self.joints.at(when)) + self.things(when))
        with np.errstate(divide='ignore'):
            floor = np.where(rays[:, 2] < 0, -eye[2] / rays[:, 2], np.inf)
        way = np.minimum(way, floor) + self.random.normal(0, 0.005, len(rays))
        way[way > 6] = np.nan
        message = PointCloud2(height=1, width=len(rays), point_step=12, row_step=12 * len(rays))
        message.header.frame_id = 'depth'
        message.header.stamp = rospy.Time.from_sec(when)
        message.fields = [PointField(name, 4 * i, PointField.FLOAT32, 1) for i, name in enumerate('xyz')]
        message.data = (self.rays * way[:, None]).astype('<f4').tobytes()
        return message


# ------------------------------------------------------------------------------------------- the light
def configuration(folder, latency_ms, avoid):
    write_lens(folder, WIDTH, HEIGHT, FOCAL)
    path = folder / 'config.yaml'
    path.write_text(f'''fixed_frame: map
projector: {{camera_info: lens.yaml, frame: projector_optical_frame, latency_ms: {latency_ms}}}
surfaces: {{floor: {{frame: map}}}}
layers: [{{topic: /marker, type: visualization_msgs/Marker}}]
''' + avoid)
    return path


class Pictures:
    """Times of arrival, and which of the judged rays were lit."""

    def __init__(self):
        import rospy
        self.all = []
        self.kept = rospy.Subscriber('/projector_node/image', rospy.AnyMsg, self.on_picture, buff_size=1 << 23,
                                     tcp_nodelay=True)

    def on_picture(self, message):
        now = time.time()
        self.all.append((now, green(message, WIDTH, HEIGHT)[STEP // 2::STEP, STEP // 2::STEP] > 40))


def show(rospy):
    """The floor's light, and the camera's place."""
    from tf2_msgs.msg import TFMessage
    from visualization_msgs.msg import Marker
    marker = Marker(type=Marker.CUBE)
    marker.header.frame_id = 'map'
    marker.pose.orientation.w = marker.color.r = marker.color.g = marker.color.b = marker.color.a = 1
    marker.scale.x = marker.scale.y = 12
    marker.scale.z = 0.0001
    floor = rospy.Publisher('/marker', Marker, latch=True, queue_size=1)
    tf = rospy.Publisher('/tf_static', TFMessage, latch=True, queue_size=1)
    floor.publish(marker)
    tf.publish(TFMessage([link_to_base('depth', T_BASE_CAMERA)]))
    return floor, tf


def tilt_projector(rospy):
    from control_msgs.msg import FollowJointTrajectoryActionGoal
    from trajectory_msgs.msg import JointTrajectoryPoint
    publisher = rospy.Publisher('/projector/follow_joint_trajectory/goal',
                                FollowJointTrajectoryActionGoal, queue_size=1)
    wait_until(lambda: publisher.get_num_connections() > 0, 'the turret')
    goal = FollowJointTrajectoryActionGoal()
    goal.goal_id.id = 'tilt'
    goal.header.stamp = goal.goal_id.stamp = rospy.Time.now()
    goal.goal.trajectory.joint_names = ['projector_pan_joint', 'projector_tilt_joint']
    goal.goal.trajectory.points = [JointTrajectoryPoint(positions=[0, TILT], time_from_start=rospy.Duration(1.5))]
    publisher.publish(goal)
    time.sleep(2)


def act(scene, seconds):
    """Moves the arm, as the scene has it, for so long."""
    arm = Arm()
    wait_until(lambda: arm.publisher.get_num_connections() > 0, 'the arm')
    if scene != 'walking person':
        arm.go([(4, STILL if scene == 'still arm' else LEFT)])
    begin = time.time()
    if scene == 'moving arm':
        turns = int(seconds / SWING_S)
        arm.go([(SWING_S * (i + 1), LEFT if i % 2 else RIGHT) for i in range(turns)])
    else:
        time.sleep(seconds)
    return begin


def judged_rays():
    u, v = np.meshgrid(np.arange(STEP // 2, WIDTH, STEP), np.arange(STEP // 2, HEIGHT, STEP))
    return LENS.rays(u.ravel().astype(float), v.ravel().astype(float))


def housing(robot):
    """The projector's own box: what is fixed to the link that tilts."""
    return {'projector_tilt_link', 'projector_link'}


def judge(robot, joints, things, begin, pictures, projector_s, folder):
    rays_optical = judged_rays()
    hits, lit, floors, dark, shares = 0, 0, 0, 0, []
    for handed, is_lit in pictures[:-1]:
        if handed < begin:
            continue
        when = handed + projector_s
        positions = joints.at(when)
        T = robot.pose('projector_optical_frame', positions, {})
        eye, rays = T[:3, 3], rays_optical @ T[:3, :3].T
        way = cast(eye, rays, robot.solids(positions, housing(robot)) + things(when))
        floor = np.where(rays[:, 2] < 0, -eye[2] / np.minimum(rays[:, 2], -1e-9), np.inf)
        is_body = (way < floor) & (eye[2] + way * rays[:, 2] > HEIGHT_M)
        is_floor = (floor < way) & np.isfinite(floor)
        wrong = is_body & is_lit.ravel()
        hits, lit = hits + is_body.sum(), lit + wrong.sum()
        floors, dark = floors + is_floor.sum(), dark + (is_floor & ~is_lit.ravel()).sum()
        if is_body.sum() > 20:
            shares.append(wrong.sum() / is_body.sum())
        if folder and len(shares) in (40, 60):
            picture = np.zeros((*is_lit.shape, 3), np.uint8)
            picture[is_lit] = (255, 255, 255)
            picture.reshape(-1, 3)[is_body] = (0, 120, 255)
            picture.reshape(-1, 3)[wrong] = (0, 0, 255)
            cv2.imwrite(f'{folder}_{len(shares)}.png', cv2.resize(picture, None, fx=STEP, fy=STEP, interpolation=0))
    return lit / max(hits, 1), quantile(shares, 0.95), dark / max(floors, 1), len(shares)


def measure(arguments, scene, latency_ms, avoid, pictures_as, queue):
    with tempfile.TemporaryDirectory() as name, World(arguments.build, name) as world:
        import rospy
        world.node('fake_fetch_node', scan='false')
        kept, joints, robot = show(rospy), Joints(), Robot(SOURCE / 'assets/fetch.urdf')
        wait_until(lambda: 'projector_tilt_joint' in joints.tracks, 'joint states')
        tilt_projector(rospy)
        if scene == 'post':
            things = lambda when: [upright(1.5, LIGHT_Y, 0.1, 0, 1)] if when % 1 < 0.5 else []
        elif scene == 'walking person':
            things = lambda when: person(walker(when))
        else:
            things = lambda when: []
        camera = DepthCamera(robot, joints, things, arguments.hertz, arguments.sensor_ms / 1000)
        pictures = Pictures()
        world.node('projector_node', config=configuration(Path(name), latency_ms, avoid), window='false',
                   rate=60)
        wait_until(lambda: any(is_lit.any() for _, is_lit in pictures.all[-3:]), 'light')
        begin = act(scene if scene != 'post' else 'walking person', arguments.seconds)
        time.sleep(0.3)
        camera.is_on = False
        del kept
        if scene == 'post':
            queue.put(post_times(robot, joints, camera.stamps, begin, pictures.all))
        else:
            queue.put(judge(robot, joints, things, begin, pictures.all, arguments.projector_ms / 1000, pictures_as))


def post_times(robot, joints, stamps, begin, pictures):
    """From the first cloud's stamp to the first picture that is dark at half the post's height."""
    T = robot.pose('projector_optical_frame', joints.at(time.time()), {})
    p = np.linalg.inv(T) @ np.array([1.4, LIGHT_Y, 0.5, 1])
    column, row = (np.array([FOCAL * p[0] / p[2] + WIDTH / 2, FOCAL * p[1] / p[2] + HEIGHT / 2]) / STEP).astype(int)
    times = []
    for before, stamp in zip(stamps, stamps[1:]):
        if stamp > begin and before % 1 >= 0.5 and stamp % 1 < 0.5:
            dark = [handed for handed, is_lit in pictures if handed > stamp and not is_lit[row, column]]
            times += [1000 * (dark[0] - stamp)] if dark else [math.inf]
    return times


def run(*arguments):
    queue = multiprocessing.Queue()
    process = multiprocessing.Process(target=measure, args=(*arguments, queue))
    process.start()
    while process.is_alive() or not queue.empty():
        try:
            result = queue.get(timeout=1)
            process.join()
            return result
        except Empty:
            continue
    sys.exit('it could not be measured')


def avoid_block(speed):
    return f'''avoid:
  from: [{{topic: /depth/points, type: sensor_msgs/PointCloud2}}]
  robot: {{}}
  height: {HEIGHT_M}
  speed: {speed}
'''


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_build_option(parser)
    parser.add_argument('--seconds', type=float, default=10)
    parser.add_argument('--sensor-ms', type=float, default=60)
    parser.add_argument('--projector-ms', type=float, default=40)
    parser.add_argument('--hertz', type=float, default=15, help='clouds a second')
    parser.add_argument('--limit', type=float, default=0.01, help='share that may be lit')
    parser.add_argument('--pictures', help='where two pictures of each are left: white is lit, orange a body, '
                        'red a body that is lit')
    arguments = parser.parse_args()
    is_good = True
    for scene in ('still arm', 'moving arm', 'walking person'):
        for name, known in CONFIGURATIONS.items():
            latency_ms, speed = known or (None, 0)
            latency_ms = arguments.projector_ms if latency_ms is None else latency_ms
            pictures_as = f'{arguments.pictures}/{scene}_{name}'.replace(' ', '_') if arguments.pictures else ''
            lit, p95, dark, count = run(arguments, scene, latency_ms, avoid_block(speed) if known else '', pictures_as)
            print(f'{scene:<14} {name:<14} lit {100 * lit:5.1f} % (p95 {100 * p95:5.1f} %), dark {100 * dark:5.1f} % '
                  f'of {count} pictures', flush=True)
            if name == 'delay known':
                is_good = is_good and lit <= arguments.limit
    times = run(arguments, 'post', arguments.projector_ms, avoid_block(1.6), '')
    print(f'post: dark {quantile(times, 0.5):.0f} ms after the stamp (p50), {quantile(times, 0.95):.0f} (p95), '
          f'{max(times):.0f} (max of {len(times)}); {arguments.sensor_ms:.0f} of them are the sensor\'s')
    return 0 if is_good else 1


if __name__ == '__main__':
    sys.exit(main())
