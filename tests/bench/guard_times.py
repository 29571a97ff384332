#!/usr/bin/env python3
"""How long does it take to stop a robot, whatever becomes of player, guards, master and network?

    tests/bench/guard_times.py [--build build] [CASE...]

A recorded drive with an arm's motion is replayed by player_node; afterglow_guard runs where the robot
is, which is this process: it hears velocities, goals and cancels. Once both are in motion, something
ends. Prints for each case the time to the first zero velocity and to the first cancel, in ms, and what
is promised; and how long a velocity was in force after the zero. Status 1: a promise was broken. Before
that: how large the watchdog beside a player is, and how soon after its start it knows what it may have
to stop, and whoever listens there is connected to it. The player "afar" runs in a network namespace,
for which one has to be root. Needs the Python of ROS.
"""
import argparse
import json
import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import xmlrpc.client
from pathlib import Path

from fetch_world import World, add_build_option, wait_until

ARM = '/arm/follow_joint_trajectory'
HERE, THERE, SPACE = '10.213.7.1', '10.213.7.2', 'afterglow_guard_times'
LENGTH_S = 60
WATCHED_S = 1.5  # after the stop: nothing may drive on
BURST_MS = 50    # what lay in the cables when a network comes back, all at once, with a zero behind it
NOTHING_S = 4    # if nothing stops until then, nothing does


class Robot:
    """Hears what moves and what stops it, and when."""

    def __init__(self):
        import rospy
        from actionlib_msgs.msg import GoalID, GoalStatusArray
        from control_msgs.msg import FollowJointTrajectoryActionGoal
        from geometry_msgs.msg import Twist
        from sensor_msgs.msg import JointState
        self.forget()
        rospy.Subscriber('/cmd_vel', Twist, self.on_velocity, tcp_nodelay=True)
        rospy.Subscriber(ARM + '/goal', FollowJointTrajectoryActionGoal, self.on_goal, tcp_nodelay=True)
        rospy.Subscriber(ARM + '/cancel', GoalID, self.on_cancel, tcp_nodelay=True)
        self.status = rospy.Publisher(ARM + '/status', GoalStatusArray, queue_size=1, latch=True)
        self.status.publish(GoalStatusArray())
        self.joints = rospy.Publisher('/joint_states', JointState, queue_size=1)
        threading.Thread(target=self.live, daemon=True).start()

    def live(self):
        from sensor_msgs.msg import JointState
        while True:
            self.joints.publish(JointState(name=['elbow'], position=[0.1]))
            time.sleep(0.02)

    def forget(self):
        self.velocities, self.goals, self.cancels = [], [], []

    def on_velocity(self, message):
        self.velocities.append((time.monotonic(), message.linear.x))

    def on_goal(self, _):
        self.goals.append(time.monotonic())

    def on_cancel(self, _):
        self.cancels.append(time.monotonic())

    def moves(self):
        return self.goals and sum(1 for _, v in self.velocities if v) > 10

    def drove_on(self, zero):
        """For how long, s, a velocity was the last word after the first zero."""
        after = [(at, v) for at, v in self.velocities if at > zero] + [(time.monotonic(), 0)]
        return sum(end - begin for (begin, v), (end, _) in zip(after, after[1:]) if v)

    def stopped(self, since):
        """When the first zero and the first cancel came; None: not yet."""
        zeros = [at for at, v in self.velocities if at > since and v == 0]
        cancels = [at for at in self.cancels if at > since]
        return (zeros or [None])[0], (cancels or [None])[0]


def write_bag(path):
    import rosbag
    import rospy
    from control_msgs.msg import FollowJointTrajectoryActionGoal
    from geometry_msgs.msg import Twist
    from sensor_msgs.msg import JointState
    from trajectory_msgs.msg import JointTrajectoryPoint
    begin = 1600000000
    with rosbag.Bag(str(path), 'w') as bag:
        bag.write('/joint_states', JointState(name=['elbow'], position=[0.1]), rospy.Time(begin))
        goal = FollowJointTrajectoryActionGoal()
        goal.goal.trajectory.joint_names = ['elbow']
        goal.goal.trajectory.points = [JointTrajectoryPoint(
            positions=[1.0], time_from_start=rospy.Duration(LENGTH_S))]
        bag.write(ARM + '/goal', goal, rospy.Time(begin, 100000000))
        forward = Twist()
        forward.linear.x = 0.2
        for i in range(LENGTH_S * 20):
            bag.write('/cmd_vel', forward, rospy.Time(begin) + rospy.Duration(0.05 * i + 0.01))


class Network:
    """A namespace with a cable to here; `is_there` is false where it cannot be made."""

    def __init__(self):
        self.is_there = False
        if os.geteuid() != 0 or not shutil.which('ip'):
            self.why_not = 'no network namespace: needs root and iproute2'
            return
        self.close()
        commands = [f'netns add {SPACE}', f'link add agt0 type veth peer name agt1 netns {SPACE}',
                    f'addr add {HERE}/24 dev agt0', 'link set agt0 up',
                    f'-n {SPACE} addr add {THERE}/24 dev agt1', f'-n {SPACE} link set agt1 up',
                    f'-n {SPACE} link set lo up']
        for command in commands:
            done = subprocess.run(['ip', *command.split()], capture_output=True, text=True)
            if done.returncode != 0:
                self.why_not = f'no network namespace: ip {command}: {done.stderr.strip()}'
                self.close()
                return
        self.is_there = True

    def set(self, state):
        subprocess.run(['ip', '-n', SPACE, 'link', 'set', 'agt1', state], check=True)

    @staticmethod
    def close():
        subprocess.run(['ip', 'netns', 'del', SPACE], capture_output=True)
        subprocess.run(['ip', 'link', 'del', 'agt0'], capture_output=True)


def ros_kill(*nodes):
    master = xmlrpc.client.ServerProxy(os.environ['ROS_MASTER_URI'])
    calls = []
    for node in nodes:
        uri = master.lookupNode('/witness', node)[2]
        calls.append(threading.Thread(
            target=lambda uri=uri: xmlrpc.client.ServerProxy(uri).shutdown('/witness', 'a test')))
    for call in calls:
        call.start()
    for call in calls:
        call.join()


class Run:
    """A player in motion, its watchdog, and the guard on the robot."""

    count = 0

    def __init__(self, world, robot, behavior, is_afar):
        from afterglow.srv import PlayBehavior
        Run.count += 1
        self.world, self.robot = world, robot
        self.name = f'/player_{Run.count}'
        robot.forget()
        self.guard = world.start(world.build / 'bin/afterglow_guard')
        master = xmlrpc.client.ServerProxy(os.environ['ROS_MASTER_URI'])

        def is_guard_there():
            code, _, uri = master.lookupNode('/witness', '/afterglow_guard')
            try:
                return code == 1 and xmlrpc.client.ServerProxy(uri).getPid('/witness')[2] == self.guard.pid
            except OSError:
                return False
        wait_until(is_guard_there, 'afterglow_guard')
        away = ['ip', 'netns', 'exec', SPACE, 'env', f'ROS_HOSTNAME={THERE}'] if is_afar else []
        self.reports = world.folder / f'reports_{Run.count}'
        self.player = world.start(
            *away, world.build / 'bin/player_node', f'__name:={self.name[1:]}', f'_store:={world.store}',
            '_allow_motion:=true', '_open_loop:=true', '_no_scan:=true', '_hold:=0',
            f'_report_folder:={self.reports}')
        world.call(self.name + '/play', PlayBehavior, behavior_id=behavior)
        wait_until(robot.moves, 'the robot to move')
        self.watchdog = self.child(self.player.pid)

    @staticmethod
    def child(pid):
        for task in Path(f'/proc/{pid}/task').iterdir():
            children = (task / 'children').read_text().split()
            if children:
                return int(children[0])
        raise RuntimeError('the player has no watchdog')

    def signal(self, number, *whom):
        for pid in whom or (self.watchdog, self.player.pid):
            os.kill(pid, number)

    def measure(self, act):
        """Times to zero and cancel in ms, and for how many ms the robot drove on."""
        since = time.monotonic()
        act(self)
        limit = since + NOTHING_S
        while None in self.robot.stopped(since) and time.monotonic() < limit:
            time.sleep(0.002)
        zero, cancel = self.robot.stopped(since)
        end = time.monotonic() + WATCHED_S
        while time.monotonic() < end:
            time.sleep(0.01)
        drove_on = 0 if zero is None else self.robot.drove_on(zero) * 1e3
        return [None if at is None else (at - since) * 1e3 for at in (zero, cancel)], drove_on

    def patience(self):
        """Of the guard on the robot, as the report says; None: no report could be written."""
        reports = list(self.reports.glob('*.json')) if self.reports.exists() else []
        return json.loads(reports[0].read_text())['guards'] if reports else None

    def close(self):
        self.signal_quietly(signal.SIGCONT)
        for process in (self.player, self.guard):
            if process in self.world.processes:
                self.world.stop(process)

    def signal_quietly(self, number):
        for pid in (self.player.pid, self.watchdog):
            try:
                os.kill(pid, number)
            except OSError:
                pass


def text(words):
    words = words if isinstance(words, bytes) else words.encode()
    return struct.pack('<I', len(words)) + words


def start_watchdog(program):
    """ms from its start until it knows what stops /cmd_vel and a cancel, and until all hear it; its MB."""
    from actionlib_msgs.msg import GoalID
    from geometry_msgs.msg import Twist
    stops = ((ARM + '/cancel', GoalID, bytes(12)), ('/cmd_vel', Twist, bytes(48)))
    outputs = b'o' + struct.pack('<Q', 1) + text('/measured') + text('') + struct.pack('<II', 1, len(stops))
    for topic, kind, stop in stops:
        outputs += text(topic) + text(kind._type) + text(kind._md5sum) + text(kind._full_text) + text(stop)
    ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    begin = time.monotonic()
    watchdog = subprocess.Popen([program, '/measured_guard'], stdin=its)
    its.close()
    ours.send(outputs)
    ours.recv(65536)
    known = time.monotonic()
    for count in range(1, 1000):
        ours.send(b'b' + struct.pack('<QIQIBBI', 1, count, 0, 60, 0, 0, 0))
        answer = ours.recv(65536)
        if all(struct.unpack(f'<{len(stops)}I', answer[-4 * len(stops):])):
            break
        time.sleep(0.001)
    heard = time.monotonic()
    status = Path(f'/proc/{watchdog.pid}/status').read_text()
    ours.close()
    watchdog.wait()
    return (known - begin) * 1e3, (heard - begin) * 1e3, int(re.search(r'VmRSS:\s+(\d+)', status)[1]) / 1024


def print_watchdog(build):
    program = build / 'bin/afterglow_replay_guard'
    loaded = subprocess.run(['ldd', program], check=True, capture_output=True, text=True).stdout
    starts = [start_watchdog(program) for _ in range(9)]
    known, heard, memory = (sorted(values)[len(starts) // 2] for values in zip(*starts))
    print(f'watchdog: {program.stat().st_size / 1000:.0f} kB, {len(loaded.splitlines())} libraries, '
          f'{memory:.1f} MB; it knows its stops {known:.0f} ms after its start, and is heard after '
          f'{heard:.0f} ms (median of {len(starts)})')


def sleep_and_wake(run):
    run.signal(signal.SIGSTOP)
    threading.Timer(1.5, lambda: run.signal_quietly(signal.SIGCONT)).start()


def end_master(run):
    for entry in Path('/proc').iterdir():
        if entry.name.isdigit():
            try:
                words = (entry / 'cmdline').read_bytes().split(b'\0')
            except OSError:
                continue
            port = os.environ['ROS_MASTER_URI'].rsplit(':', 1)[1].encode()
            if any(word.endswith(b'rosmaster') for word in words) and port in words:
                os.kill(int(entry.name), signal.SIGKILL)


def cut(network, seconds):
    def act(_):
        network.set('down')
        if seconds < 0.5:
            time.sleep(seconds)
            network.set('up')
        else:
            threading.Timer(seconds, lambda: network.set('up')).start()
    return act


def cases(network):
    """(name, afar, what happens, promised ms; None: it goes on)"""
    watchdog = lambda run: run.watchdog
    beside, at_once, afar = 250, 100, 1100
    yield 'kill -9 of the player', False, lambda r: r.signal(signal.SIGKILL, r.player.pid), at_once
    yield 'SIGSTOP of the player', False, lambda r: r.signal(signal.SIGSTOP, r.player.pid), beside
    yield 'SIGTERM of the player', False, lambda r: r.signal(signal.SIGTERM, r.player.pid), at_once
    yield 'rosnode kill of the player', False, lambda r: ros_kill(r.name), at_once
    yield 'kill -9 of its watchdog', False, lambda r: r.signal(signal.SIGKILL, watchdog(r)), at_once
    yield 'SIGTERM of its watchdog', False, lambda r: r.signal(signal.SIGTERM, watchdog(r)), at_once
    yield 'rosnode kill of its watchdog', False, lambda r: ros_kill(r.name + '_guard'), at_once
    yield 'rosnode kill of both', False, lambda r: ros_kill(r.name, r.name + '_guard'), at_once
    yield 'SIGTERM of both', False, lambda r: r.signal(signal.SIGTERM), at_once
    yield 'kill -9 of both', False, lambda r: r.signal(signal.SIGKILL), beside
    yield 'both stopped, and on after 1.5 s', False, sleep_and_wake, beside
    yield 'SIGTERM of afterglow_guard', False, lambda r: r.signal(signal.SIGTERM, r.guard.pid), at_once
    yield 'kill -9 of afterglow_guard', False, lambda r: r.signal(signal.SIGKILL, r.guard.pid), at_once
    yield 'afar: kill -9 of both', True, lambda r: r.signal(signal.SIGKILL), afar
    yield 'afar: both stopped (suspend), and on after 1.5 s', True, sleep_and_wake, afar
    yield 'afar: network cut, and back after 2 s', True, cut(network, 2), afar
    yield 'afar: network cut for 25 ms: a packet is lost', True, cut(network, 0.025), None
    yield 'the master killed', False, end_master, 850


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    add_build_option(parser)
    parser.add_argument('cases', nargs='*', help='words of the cases to run; default: all')
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix='guard_times_'))
    network = Network()
    is_broken = False
    try:
        with World(options.build, folder, HERE if network.is_there else 'localhost') as world:
            robot = Robot()
            write_bag(folder / 'drive.bag')
            subprocess.run([world.build / 'bin/afterglow', 'import', folder / 'drive.bag', '--store',
                            world.store], check=True, stdout=subprocess.DEVNULL)
            print_watchdog(world.build)
            print(f'{"ms":48}  zero cancel promised')
            for name, is_afar, act, promised in cases(network):
                if options.cases and not any(word in name for word in options.cases):
                    continue
                if is_afar and not network.is_there:
                    print(f'{name:48}  skipped: {network.why_not}')
                    continue
                run = Run(world, robot, 1, is_afar)
                times, drove_on = run.measure(act)
                run.close()
                guards = run.patience()
                is_kept = times == [None, None] if promised is None else drove_on < BURST_MS and all(
                    at is not None and at < promised for at in times)
                is_broken |= not is_kept
                shown = ' '.join('   never' if at is None else f'{at:6.0f}' for at in times)
                print(f'{name:48}{shown} {promised or "never":>8}'
                      + ('' if is_kept else '  BROKEN')
                      + (f'  drove on for {drove_on:.0f} ms' if drove_on else '')
                      + (f'  {json.dumps(guards)}' if guards else '  (no report)'), flush=True)
    finally:
        if network.is_there:
            network.close()
        shutil.rmtree(folder, ignore_errors=True)
    return 1 if is_broken else 0


if __name__ == '__main__':
    sys.exit(main())
