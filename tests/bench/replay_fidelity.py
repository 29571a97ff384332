#!/usr/bin/env python3
"""How far from the recorded place a replayed drive ends: the detour of the paper's figure.

    tests/bench/replay_fidelity.py [--build build] [--replays 50] [--parallel 4] [--noisy-recording]

A fake Fetch that slips and obeys 80 ms late turns, drives 3 m round something and turns back; that is
recorded once by recorder_node. Then others drive it again by `afterglow play --allow-motion`: each
with wheels of its own (1 % of scale, of distances and of turns, standard deviation), slip, latency and
a start that is 1 cm and 0.5 deg off, on a localization of 3 cm and 1 deg, on one of 1 cm and 0.2 deg
(five times a second, at rest, too), and open loop. Prints, by the robot's true pose, how far they end from where the recorded one ended:
median and 95th percentile in cm and deg. With --noisy-recording the recorded drive was localized just
as badly, and stood for 10 s at its end. Needs the Python of ROS; about 20 s for each replay.
"""
import argparse
import math
import multiprocessing
import random
import shutil
import tempfile
import time
from pathlib import Path

from fetch_world import Truth, World, add_build_option, quantile, wrap

START = (2.0, 1.0, 0.3)
WHEELS = {'slip': 0.02, 'latency': 0.08}
ALWAYS_LOOKING = {'localization_distance': 0, 'localization_turn': 0}
PERIOD_S = 0.02
LOCALIZATIONS = {'3 cm': (0.03, math.radians(1)), '1 cm': (0.01, math.radians(0.2))}


def profile(gone, length, fastest, acceleration):
    up = math.sqrt(2 * acceleration * gone) + acceleration * PERIOD_S
    down = math.sqrt(2 * acceleration * max(length - gone, 0))
    return min(up, down, fastest, (length - gone) / PERIOD_S)


def turn(angle):
    gone = 0
    while abs(angle) - gone > 1e-3:
        speed = profile(gone, abs(angle), 1.0, 1.5)
        yield 0.0, math.copysign(speed, angle)
        gone += speed * PERIOD_S


def bend(length, offset):
    """Straight on, bent to the left by offset in the middle: sin^2."""
    k, x = math.pi / length, 0
    while length - x > 1e-3:
        way = math.hypot(1, offset * k * math.sin(2 * k * x))
        speed = profile(x, length, 0.5, 0.5)
        yield speed, speed * 2 * offset * k * k * math.cos(2 * k * x) / way ** 3
        x += speed / way * PERIOD_S


def detour():
    stand = [(0.0, 0.0)] * 25
    return stand + list(turn(math.pi / 2)) + list(bend(3.0, 0.5)) + list(turn(-math.pi / 2)) + stand


def drive(velocities):
    import rospy
    from geometry_msgs.msg import Twist
    publisher = rospy.Publisher('/cmd_vel', Twist, queue_size=10)
    while publisher.get_num_connections() < 2:  # robot and recorder
        time.sleep(0.01)
    begin = time.monotonic()
    for i, (forward, left) in enumerate(velocities):
        time.sleep(max(0, begin + i * PERIOD_S - time.monotonic()))
        message = Twist()
        message.linear.x, message.angular.z = forward, left
        publisher.publish(message)


def robot(world, start, seed, localization, **wheels):
    position, yaw = localization
    return world.node('fake_fetch_node', x=start[0], y=start[1], yaw=start[2], seed=seed,
                      localization_error=position, localization_yaw_error=yaw, **ALWAYS_LOOKING, **WHEELS, **wheels)


def record(build, folder, localization, stood_s):
    """Returns the behavior and where it truly ended."""
    with World(build, folder) as world:
        truth = Truth()
        robot(world, START, 1, localization, linear_scale=1, angular_scale=1)
        truth.wait()
        end = []

        def perform():
            time.sleep(stood_s)  # seen at its start, too
            drive(detour())
            end.append(truth.at_rest())
            time.sleep(stood_s)

        return world.record('detour', ['/cmd_vel'], perform), end[0]


def replay_all(share):
    """Replays one after the other; returns (m off, rad off, why it failed) of each."""
    build, folder, behavior, store, localization, options, seeds, end = share
    found = []
    with World(build, folder) as world:
        truth = Truth()
        for seed in seeds:
            dice = random.Random(seed)
            off = [dice.gauss(0, 0.01), dice.gauss(0, 0.01), dice.gauss(0, math.radians(0.5))]
            fetch = robot(world, [a + b for a, b in zip(START, off)], seed, localization,
                          linear_scale=dice.gauss(1, 0.01), angular_scale=dice.gauss(1, 0.01))
            truth.forget()
            truth.wait()
            _, problem = world.play(behavior, store, '--start-tolerance', 'base=0.15',
                                    'base_turn=0.1', '--longest-stall', '0.5', *options)
            x, y, yaw = truth.at_rest()
            found.append((math.hypot(x - end[0], y - end[1]), abs(wrap(yaw - end[2])), problem))
            world.stop(fetch)
    return found


def in_process(work, arguments, count):
    """Every master needs a process of its own."""
    with multiprocessing.Pool(count, maxtasksperchild=1) as pool:
        return pool.starmap(work, arguments, chunksize=1)


def show(title, found):
    ended = [(far, turned) for far, turned, problem in found if not problem]
    far, turned = [100 * f for f, _ in ended], [math.degrees(t) for _, t in ended]
    print('%-24s %3d replays   %6.2f %6.2f cm   %6.2f %6.2f deg   (worst %.2f cm, %.2f deg)' %
          (title, len(ended), quantile(far, 0.5), quantile(far, 0.95), quantile(turned, 0.5),
           quantile(turned, 0.95), max(far, default=math.nan), max(turned, default=math.nan)),
          flush=True)
    for _, _, problem in found:
        if problem:
            print('    one failed: ' + problem, flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    add_build_option(parser)
    parser.add_argument('--replays', type=int, default=50)
    parser.add_argument('--parallel', type=int, default=4, help='masters at the same time; default 4')
    parser.add_argument('--noisy-recording', action='store_true')
    parser.add_argument('--only', choices=['3 cm', '1 cm', 'open loop'], help='one of the three')
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix='replay_fidelity_'))
    print('%-24s               %8s %6s       %6s %6s' % ('', 'p50', 'p95', 'p50', 'p95'))
    try:
        for title in [options.only] if options.only else ['3 cm', '1 cm', 'open loop']:
            localization = LOCALIZATIONS.get(title, (0, 0))
            place = folder / title.replace(' ', '_')
            place.mkdir()
            how = ['--open-loop']
            if any(localization):
                how = ['--localization-noise', 'position=%g' % localization[0], 'yaw=%g' % localization[1]]
            seen = localization if options.noisy_recording else (0, 0)
            stood_s = 10 if options.noisy_recording else 1
            behavior, end = in_process(record, [(options.build, place, seen, stood_s)], 1)[0]
            shares = []
            for i in range(min(options.parallel, options.replays)):
                (place / str(i)).mkdir()
                shares.append(((options.build, place / str(i), behavior, place / 'behaviors.db',
                                localization, how,
                                range(100 + i, 100 + options.replays, options.parallel), end),))
            found = [one for share in in_process(replay_all, shares, len(shares)) for one in share]
            show(title, found)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == '__main__':
    main()
