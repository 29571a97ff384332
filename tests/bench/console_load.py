#!/usr/bin/env python3
"""How fast does the console answer from a large store?

    tests/bench/console_load.py [--build build] [--behaviors 1000] [--messages 1000] [--store FILE]

Makes a store of so many behaviors of so many messages each (bags, imported; --store keeps it, or takes
one that is there), starts `afterglow console` on it and asks as a page would: searches letter by
letter, behaviors, pictures of both views while scrubbing forward and back; in Chromium, where there is
one, also how soon the page is painted and the list follows what is typed. Meanwhile recorder_node records
a topic of 1 kHz into the same store; what it lost is told. Prints median and 99th percentile in ms. Needs
the Python of ROS.
"""
import argparse
import json
import math
import os
import random
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.parse
import urllib.request
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NAMES = ['pick', 'place', 'drive', 'unfold', 'look', 'hand over', 'open gripper', 'dock']
WORDS = ['gearbox', 'caddy', 'obstacle', 'table', 'small', 'red', 'left', 'screw', 'around', 'careful']
BEGIN = 1_700_000_000
SECONDS = 10.0


class BagMaker:
    """Bags of one behavior: tf of a driving projector, light, speech, a goal and its result."""

    def __init__(self, build):
        sys.path[:0] = [str(build / 'devel/lib/python3/dist-packages')]
        import genpy
        import rosbag
        from geometry_msgs.msg import Point, TransformStamped, Twist
        from sound_play.msg import SoundRequest
        from std_msgs.msg import ColorRGBA
        from tf2_msgs.msg import TFMessage
        from control_msgs.msg import PointHeadActionGoal, PointHeadActionResult
        from visualization_msgs.msg import Marker, MarkerArray
        self.rosbag, self.genpy = rosbag, genpy
        self.Point, self.TransformStamped, self.Twist = Point, TransformStamped, Twist
        self.SoundRequest, self.ColorRGBA, self.TFMessage = SoundRequest, ColorRGBA, TFMessage
        self.Goal, self.Result = PointHeadActionGoal, PointHeadActionResult
        self.Marker, self.MarkerArray = Marker, MarkerArray

    def transform(self, parent, child, xyz, quaternion, stamp):
        made = self.TransformStamped()
        made.header.frame_id, made.child_frame_id, made.header.stamp = parent, child, stamp
        made.transform.translation.x, made.transform.translation.y, made.transform.translation.z = xyz
        (made.transform.rotation.x, made.transform.rotation.y, made.transform.rotation.z,
         made.transform.rotation.w) = quaternion
        return made

    def path(self, t, stamp):
        marker = self.Marker(ns='path', id=0, type=self.Marker.LINE_STRIP)
        marker.header.frame_id, marker.header.stamp = 'map', stamp
        marker.pose.orientation.w = 1
        marker.scale.x = 0.05
        marker.color = self.ColorRGBA(0, 1, 0, 1)
        marker.points = [self.Point(0.5 + 0.03 * i, 0.4 * math.sin(0.2 * i + t), 0) for i in range(60)]
        return self.MarkerArray([marker])

    def make(self, path, number, messages):
        random.seed(number)
        begin = BEGIN + number * 600
        with self.rosbag.Bag(str(path), 'w') as bag:
            at = lambda t: self.genpy.Time(begin + int(t), int((t % 1) * 1e9))
            bag.write('/tf_static', self.TFMessage([
                self.transform('base_link', 'projector_optical_frame', (0, 0, 1.6),
                               (-0.65, 0.65, -0.27, 0.27), at(0)),
                self.transform('map', 'caddy_table', (1, 1, 0.7), (0, 0, 0, 1), at(0))]), at(0))
            goal = self.Goal()
            goal.goal_id.id = 'goal %d' % number
            bag.write('/head_controller/point_head/goal', goal, at(1))
            for i in range(2):
                words = ' '.join(random.sample(WORDS, 4))
                bag.write('/robotsound', self.SoundRequest(
                    sound=-3, command=1, arg='I take the %s' % words), at(2 + 3 * i))
            result = self.Result()
            result.status.goal_id.id = goal.goal_id.id
            result.status.status = 4 if number % 7 == 0 else 3
            result.status.text = 'did not reach it' if number % 7 == 0 else ''
            bag.write('/head_controller/point_head/result', result, at(5.1))
            left = messages - 5
            for i in range(left):
                t = SECONDS * i / left
                if i % 20 == 10:
                    bag.write('/projector/nav/path', self.path(t, at(t)), at(t))
                elif i % 2 == 0:
                    bag.write('/tf', self.TFMessage([self.transform(
                        'map', 'base_link', (0.05 * t, 0, 0), (0, 0, 0, 1), at(t))]), at(t))
                else:
                    twist = self.Twist()
                    twist.linear.x = 0.05
                    bag.write('/cmd_vel', twist, at(t))


def fill(maker, afterglow, store, behaviors, messages):
    folder = Path(tempfile.mkdtemp())
    try:
        for first in range(0, behaviors, 100):
            bags = []
            for number in range(first, min(behaviors, first + 100)):
                bag = folder / str(number) / (NAMES[number % len(NAMES)] + '.bag')
                bag.parent.mkdir()
                maker.make(bag, number, messages)
                bags.append(str(bag))
            subprocess.run([afterglow, 'import', *bags, '--store', str(store)], check=True,
                           stdout=subprocess.DEVNULL)
            for bag in bags:
                shutil.rmtree(Path(bag).parent)
            print('%d behaviors' % min(behaviors, first + 100), file=sys.stderr)
    finally:
        shutil.rmtree(folder)


class Console:
    def __init__(self, afterglow, store):
        self.process = subprocess.Popen(
            [afterglow, 'console', '--port', '0', '--store', str(store), '--config',
             str(ROOT / 'assets/demo/projector.yaml')], stdout=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        self.url = line[line.index('http://'):line.index('/;')]

    def get(self, path, **query):
        """Answer and seconds."""
        url = self.url + path + ('?' + urllib.parse.urlencode(query) if query else '')
        began = time.perf_counter()
        with urllib.request.urlopen(url) as answer:
            body = answer.read()
        return body, time.perf_counter() - began

    def wait_until_read(self, behaviors):
        began = time.monotonic()
        while True:
            found = json.loads(self.get('/api/behaviors', q='said:take', limit=0)[0])
            if found['matching'] >= behaviors:
                return time.monotonic() - began
            time.sleep(0.2)

    def end(self):
        self.process.terminate()
        self.process.wait()


class Recorder:
    """recorder_node, which records 1,000 messages a second into the store."""

    def __init__(self, maker, build, store):
        self.folder = tempfile.mkdtemp()
        bag = Path(self.folder) / 'kilohertz.bag'
        with maker.rosbag.Bag(str(bag), 'w') as written:
            for i in range(20000):
                written.write('/kilohertz', maker.Twist(), maker.genpy.Time(BEGIN + i // 1000, i % 1000 * 1000000))
        with socket.socket() as free:
            free.bind(('127.0.0.1', 0))
            port = free.getsockname()[1]
        self.environment = {**os.environ, 'ROS_MASTER_URI': 'http://127.0.0.1:%d' % port, 'ROS_IP': '127.0.0.1',
                            'ROS_HOME': self.folder, 'ROS_LOG_DIR': self.folder,
                            'PYTHONPATH': str(build / 'devel/lib/python3/dist-packages')}
        self.processes = [self.start('rosmaster', '--core', '-p', str(port))]
        while subprocess.run(['rosparam', 'set', '/use_sim_time', 'false'], env=self.environment,
                             stderr=subprocess.DEVNULL).returncode:
            time.sleep(0.2)
        self.processes.append(self.start('rosbag', 'play', '--quiet', '--loop', str(bag)))
        self.processes.append(self.start(str(build / 'bin/recorder_node'), '_store:=%s' % store))
        while not self.ask('start_recording', "{name: load, topics: [/kilohertz]}"):
            time.sleep(0.2)
        self.began = time.monotonic()

    def start(self, *command):
        return subprocess.Popen(command, env=self.environment, stdout=subprocess.DEVNULL,
                                stderr=subprocess.DEVNULL, start_new_session=True)

    def ask(self, service, request):
        """Its answer as text; empty: none."""
        return subprocess.run(['rosservice', 'call', '/recorder_node/' + service, request], env=self.environment,
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True).stdout

    def end(self):
        """What it says of the recording."""
        seconds = time.monotonic() - self.began
        answer = self.ask('stop_recording', "{outcome: success}")
        for process in reversed(self.processes):
            os.killpg(process.pid, signal.SIGTERM)
            process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)
        figure = lambda name: int(re.search(name + r': (\d+)', answer)[1])
        return '%d messages recorded meanwhile in %.0f s, %d lost' % (figure('messages'), seconds, figure('dropped'))


def tell(what, seconds):
    ordered = sorted(seconds)
    quantile = lambda q: 1000 * ordered[min(len(ordered) - 1, int(q * len(ordered)))]
    print('%-42s %6d %9.1f %9.1f' % (what, len(seconds), quantile(0.5), quantile(0.99)))


def measure(console):
    print('%-42s %6s %9s %9s' % ('', 'times', 'median ms', 'p99 ms'))
    ids = [b['id'] for b in json.loads(console.get('/api/behaviors', limit=1000)[0])['behaviors']]
    words = ['pick', 'caddy gearbox', 'said:obstacle name:drive', 'outcome:imported screw red']
    tell('search, letter by letter', [
        console.get('/api/behaviors', q=word[:end])[1]
        for _ in range(3) for word in words for end in range(1, len(word) + 1)])
    tell('a list of 1,000', [console.get('/api/behaviors', limit=1000)[1] for _ in range(10)])
    tell('the calendar', [console.get('/api/calendar')[1] for _ in range(20)])
    chosen = ids[100:150]
    tell('a behavior, for the first time', [console.get('/api/behaviors/%d' % i)[1] for i in chosen])
    tell('a behavior, again', [console.get('/api/behaviors/%d' % chosen[-1])[1] for _ in range(50)])
    tell('a message at a moment', [
        console.get('/api/behaviors/%d/message' % i, topic='/cmd_vel', t=7.3)[1] for i in chosen])
    for view in ('projector', 'bystander'):
        path = '/api/behaviors/%d/picture' % chosen[-1]
        try:
            tell(view + ', the first picture', [
                console.get('/api/behaviors/%d/picture' % i, view=view, width=640)[1]
                for i in chosen[:5]])
            picture = lambda t: console.get(path, view=view, width=640, t='%.2f' % t)[1]
            picture(0)
            tell(view + ', scrubbing forward', [picture(0.09 * i + 0.05) for i in range(100)])
            tell(view + ', scrubbing back', [picture(9.47 - 0.09 * i) for i in range(100)])
            tell(view + ', back where it was', [picture(9.47 - 0.09 * i) for i in range(100)])
        except urllib.error.HTTPError as error:
            print(view, 'has no pictures:', error.read().decode())


TYPED = """
const [word, done] = arguments, input = document.querySelector('#search'), took = [];
let end = 0, began;
const next = () => {
  if (++end > word.length) { watch.disconnect(); return done(took); }
  input.value = word.slice(0, end);
  began = performance.now();
  input.dispatchEvent(new Event('input'));
};
const watch = new PerformanceObserver((list) => {
  if (!list.getEntries().some((entry) => entry.name.includes('/api/behaviors?'))) return;
  requestAnimationFrame(() => requestAnimationFrame(() => {
    took.push((performance.now() - began) / 1000);
    setTimeout(next, 400);
  }));
});
watch.observe({type: 'resource'});
next();"""


def measure_page(console):
    sys.path.append(str(ROOT / 'tests/console'))
    from browser import MISSING, Driver
    if MISSING:
        print('no page was measured:', MISSING)
        return
    driver = Driver()
    try:
        browser = driver.browser()
        painted = []
        for _ in range(10):
            browser.open('about:blank')
            browser.open(console.url + '/')
            browser.find('.row .name')
            painted.append(browser.run("return performance.getEntriesByName('first-contentful-paint')[0].startTime"))
        tell('the page, first painted', [ms / 1000 for ms in painted])
        tell('the list after a letter typed', sum((browser.run_async(TYPED, word) for word in
                                                   ('caddy gearbox', 'drive', 'obstacle red')), []))
        browser.close()
    finally:
        driver.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--build', type=Path, default=ROOT / 'build')
    parser.add_argument('--behaviors', type=int, default=1000)
    parser.add_argument('--messages', type=int, default=1000)
    parser.add_argument('--store', type=Path)
    parser.add_argument('--quiet', action='store_true', help='nobody records meanwhile')
    options = parser.parse_args()
    afterglow = str(options.build.resolve() / 'bin/afterglow')
    maker = BagMaker(options.build.resolve())
    folder = tempfile.mkdtemp()
    store = options.store or Path(folder) / 'load.db'
    if not store.exists():
        fill(maker, afterglow, store, options.behaviors, options.messages)
    console = Console(afterglow, store)
    recorder = None
    try:
        print('all is read after %.1f s' % console.wait_until_read(options.behaviors))
        if not options.quiet:
            recorder = Recorder(maker, options.build.resolve(), store)
        measure(console)
        measure_page(console)
    finally:
        if recorder:
            print(recorder.end())
        console.end()
        shutil.rmtree(folder)


if __name__ == '__main__':
    main()
