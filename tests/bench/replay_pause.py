#!/usr/bin/env python3
"""Does a pause in mid-trajectory change the arm's path?

    tests/bench/replay_pause.py [--build build] [--pause 10]

An arm trajectory through five points is recorded on a fake Fetch and replayed by player_node, which is
paused half-way and resumed 10 s later. Prints how far the replayed path (/joint_states) is from the
recorded one, the recorded from the replayed, where the arm stood meanwhile and where it ended: the
largest of all joints, in degrees (cm for the torso). Needs the Python of ROS.
"""
import argparse
import math
import shutil
import tempfile
import time
from pathlib import Path

from fetch_world import ARM, Arm, Truth, World, add_build_option, arm_joints, wait_until

WAY = [(1.5, [0.05, 1.0, 1.0, -0.2, 1.5, 0.2, 1.4, 0.3]), (3.0, [0.10, 0.5, 0.5, 0.1, 1.2, 0.4, 1.2, 0.6]),
       (4.5, [0.20, 0.0, 0.6, 0.4, 1.0, 0.2, 0.9, 0.3]), (6.0, [0.25, -0.4, 0.2, 0.2, 1.2, -0.2, 1.1, 0.0]),
       (7.5, [0.20, -0.2, -0.1, 0.0, 0.9, 0.0, 1.3, -0.3])]
PAUSED_AFTER_S = 4.0
HALF_A_TURN_OF_TORSO_M = 1.8  # so that a degree weighs as much as a centimeter


class ArmPath:
    """Where the arm has been."""

    def __init__(self):
        import rospy
        from sensor_msgs.msg import JointState
        self.points = []
        rospy.Subscriber('/joint_states', JointState, self.on_joints, queue_size=1000)

    def on_joints(self, message):
        if arm_joints()[0] not in message.name:
            return
        at = dict(zip(message.name, message.position))
        point = [math.degrees(at[name]) for name in arm_joints()]
        point[0] = at['torso_lift_joint'] * 180 / HALF_A_TURN_OF_TORSO_M
        if not self.points or point != self.points[-1]:
            self.points.append(point)

    def taken(self):
        points, self.points = self.points, self.points[-1:]
        return points


def off_segment(point, a, b):
    """The largest joint's distance from the segment's nearest point."""
    along = [y - x for x, y in zip(a, b)]
    length = sum(d * d for d in along)
    t = sum((p - x) * d for p, x, d in zip(point, a, along)) / length if length else 0
    t = min(1, max(0, t))
    return max(abs(p - x - t * d) for p, x, d in zip(point, a, along))


def off_path(points, path):
    return max(min(off_segment(point, a, b) for a, b in zip(path, path[1:])) for point in points)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    add_build_option(parser)
    parser.add_argument('--pause', type=float, default=10)
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix='replay_pause_'))
    try:
        with World(options.build, folder) as world:
            from afterglow.srv import PlayBehavior
            from std_srvs.srv import Trigger
            path, truth, arm = ArmPath(), Truth(), Arm()
            world.node('fake_fetch_node')
            truth.wait()

            def perform():
                wait_until(lambda: arm.publisher.get_num_connections() >= 2, 'recorder and robot')
                path.taken()
                arm.go(WAY)

            behavior = world.record('wave', [ARM + '/goal'], perform)
            recorded = path.taken()
            world.call('/fake_fetch/reset', Trigger)
            time.sleep(0.5)
            path.taken()
            world.node('player_node', store=world.store, allow_motion='true', hold=0,
                       longest_stall=0.5)
            world.call('/player_node/play', PlayBehavior, behavior_id=behavior)
            wait_until(lambda: len(path.points) > 5, 'the arm to move')
            time.sleep(PAUSED_AFTER_S)
            world.call('/player_node/pause', Trigger)
            time.sleep(0.5)  # to brake
            before = path.points[-1]
            time.sleep(options.pause - 0.5)
            stood = max(abs(a - b) for a, b in zip(before, path.points[-1]))
            results = len(arm.results)
            world.call('/player_node/resume', Trigger)
            wait_until(lambda: len(arm.results) > results and arm.results[-1][2] == 3, 'the arm to end')
            time.sleep(0.3)
            replayed = path.taken()
            print('paused at %.0f %% of the way, moved by %.3f in %.1f s of pause' % (
                100 * replayed.index(before) / len(replayed), stood, options.pause))
            print('replayed off the recorded path by at most %.3f deg, recorded off the replayed by '
                  '%.3f deg' % (off_path(replayed, recorded), off_path(recorded, replayed)))
            print('ends %.3f deg from where it ended' % max(
                abs(a - b) for a, b in zip(recorded[-1], replayed[-1])))
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == '__main__':
    main()
