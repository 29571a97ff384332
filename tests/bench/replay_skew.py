#!/usr/bin/env python3
"""Do light and speech keep step with an arm that takes longer than it did?

    tests/bench/replay_skew.py [--build build] [--slowness 1.3] [--replays 1]

A behavior of three reaches, each followed by light and words about it, is recorded on a fake Fetch
and replayed by `afterglow play --allow-motion` on one whose arm takes 30 % longer; then again with
--ungated. A subscriber of its own notes when each message was published, in the recording and in the
replay. Skew: how far a message was from the arm's last result before it, less how far it had been.
Prints median, 95th percentile and largest for light and speech. Needs the Python of ROS; a replay takes
half a minute.
"""
import argparse
import shutil
import tempfile
import threading
import time
from pathlib import Path

from fetch_world import ARM, Arm, Truth, World, add_build_option, quantile, wait_until

REACHES = [[0.1, 0.6, 0.6, -0.2, 1.2, 0.0, 1.2, 0.0], [0.2, 0.0, 0.2, 0.0, 0.9, 0.3, 0.9, 0.0],
           [0.1, 0.9, 0.9, -0.2, 1.5, 0.0, 1.4, 0.0]]
REACH_S = 7.0
LIGHT, SPEECH = '/projector/marker', '/robotsound'


class Witness:
    """When each result, light and word was published, as a node beside the others sees it."""

    def __init__(self):
        import rospy
        from control_msgs.msg import FollowJointTrajectoryActionResult
        from sound_play.msg import SoundRequest
        from visualization_msgs.msg import Marker
        self.lock = threading.Lock()
        self.forget()
        listen = lambda topic, kind, on: rospy.Subscriber(topic, kind, on, tcp_nodelay=True)
        listen(ARM + '/result', FollowJointTrajectoryActionResult, lambda m: self.note('result', m))
        listen(LIGHT, Marker, lambda m: self.note('light', m) if m.action == Marker.ADD else None)
        listen(SPEECH, SoundRequest, lambda m: self.note('speech', m) if m.arg else None)

    def forget(self):
        self.seen = {'result': [], 'light': [], 'speech': []}

    def note(self, what, message):
        with self.lock:
            self.seen[what].append(time.monotonic())

    def taken(self):
        with self.lock:
            seen = self.seen
            self.forget()
            return seen


def perform():
    """Reaches, and tells of it: at once, in the following quiet and while it reaches again."""
    import rospy
    from sound_play.msg import SoundRequest
    from visualization_msgs.msg import Marker
    light = rospy.Publisher(LIGHT, Marker, queue_size=10)
    speech = rospy.Publisher(SPEECH, SoundRequest, queue_size=10)
    arm = Arm()
    wait_until(lambda: min(p.get_num_connections() for p in (light, speech)) >= 2 and
               arm.publisher.get_num_connections() >= 2, 'witness and recorder')
    time.sleep(0.5)

    def tell(number):
        marker = Marker(id=number, type=Marker.CUBE, action=Marker.ADD)
        marker.header.frame_id = 'base_link'
        marker.header.stamp = rospy.Time.now()
        marker.pose.orientation.w = marker.color.g = marker.color.a = 1
        marker.scale.x = marker.scale.y = marker.scale.z = 0.1
        light.publish(marker)
        speech.publish(SoundRequest(sound=SoundRequest.SAY, command=SoundRequest.PLAY_ONCE, volume=1,
                                    arg=f'number {number}'))

    number = 0
    for i, reach in enumerate(REACHES):
        meanwhile = [threading.Timer(at, tell, [100 * (i + 1) + n]) for n, at in enumerate((1.0, 2.5))]
        for timer in meanwhile if i else []:
            timer.start()
        arm.go([(REACH_S, reach)])
        for pause in (0.0, 0.4, 0.8, 1.2):
            time.sleep(pause)
            number += 1
            tell(number)


def skews(recorded, replayed, what):
    """Of each message, in seconds."""
    if {k: len(v) for k, v in recorded.items()} != {k: len(v) for k, v in replayed.items()}:
        raise RuntimeError('replayed were %s' % {k: '%d of %d' % (len(replayed[k]), len(v))
                                                 for k, v in recorded.items()})
    found = []
    for then, now in zip(recorded[what], replayed[what]):
        reached = sum(result < then for result in recorded['result'])
        if reached:
            distance = then - recorded['result'][reached - 1]
            found.append(now - replayed['result'][reached - 1] - distance)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    add_build_option(parser)
    parser.add_argument('--slowness', type=float, default=1.3)
    parser.add_argument('--replays', type=int, default=1, help='of each kind')
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix='replay_skew_'))
    exact = {'linear_scale': 1, 'angular_scale': 1, 'slip': 0}
    try:
        with World(options.build, folder) as world:
            witness = Witness()
            truth = Truth()
            robot = world.node('fake_fetch_node', **exact)
            truth.wait()
            behavior = world.record('tell', [ARM + '/goal', LIGHT, SPEECH], perform)
            recorded = witness.taken()
            for title, flags in (('in step', []), ('--ungated', ['--ungated'])):
                found = {'light': [], 'speech': []}
                for _ in range(options.replays):
                    world.stop(robot)
                    robot = world.node('fake_fetch_node', slowness=options.slowness, **exact)
                    truth.forget()
                    truth.wait()
                    witness.taken()
                    report, problem = world.play(behavior, world.store, '--longest-stall', '0.5', *flags)
                    if problem:
                        raise RuntimeError(problem)
                    replayed = witness.taken()
                    for what, values in found.items():
                        values += [abs(skew) for skew in skews(recorded, replayed, what)]
                for what, values in found.items():
                    print('%-10s %-7s %3d messages   p50 %8.1f ms   p95 %8.1f ms   largest %8.1f ms' % (
                        title, what, len(values), 1e3 * quantile(values, 0.5),
                        1e3 * quantile(values, 0.95), 1e3 * max(values)))
                print('           the player itself says: %s' % report.get('in_step'), flush=True)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == '__main__':
    main()
