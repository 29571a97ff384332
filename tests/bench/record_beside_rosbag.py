#!/usr/bin/env python3
"""Records the same publisher with recorder_node and with rosbag record, at the same time.

    tests/bench/record_beside_rosbag.py [--build build] [--seconds 20] [--folder DIR] [LOAD ...]

LOAD is RATExBYTES; by default 1000x1024 and 30x1000000. Every load is one run: a roscore of its own,
both recorders on one topic, both with buffers as they come (256 MB). Prints, for both, the messages
lost, CPU seconds for each MB and MB/s from the first message until all is on the disk, and the
ratios; and compares every message, byte by byte and in order. Needs a build with
-DAFTERGLOW_BUILD_BENCHMARKS=ON and the Python of ROS. With --alone recorder_node
records by itself: how much it can take.
"""
import argparse
import hashlib
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import rosbag

TICKS = os.sysconf('SC_CLK_TCK')


def free_port():
    with socket.socket() as probe:
        probe.bind(('localhost', 0))
        return probe.getsockname()[1]


def cpu_seconds(pid):
    fields = Path(f'/proc/{pid}/stat').read_text().rsplit(')', 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def rosbag_record():
    """The program itself: its wrapper would hide its CPU time."""
    found = Path(os.path.realpath(shutil.which('rosbag'))).parent.parent / 'lib/rosbag/record'
    if not found.exists():
        sys.exit(f'there is no {found}')
    return found


class Run:
    def __init__(self, options, folder):
        self.bin = Path(options.build).resolve() / 'bin'
        self.folder = folder
        self.port = free_port()
        self.environment = dict(os.environ, ROS_MASTER_URI=f'http://localhost:{self.port}',
                                ROS_HOSTNAME='localhost', ROS_LOG_DIR=str(folder / 'log'),
                                ROS_HOME=str(folder / 'ros'))
        self.processes = []

    def start(self, *command, **options):
        process = subprocess.Popen([str(word) for word in command], env=self.environment,
                                   cwd=self.folder, text=True, **options)
        self.processes.append(process)
        return process

    def __enter__(self):
        self.start('roscore', '-p', self.port, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL)
        deadline = time.time() + 20
        while time.time() < deadline:
            try:
                socket.create_connection(('localhost', self.port), 1).close()
                return self
            except OSError:
                time.sleep(0.05)
        sys.exit('roscore does not answer')

    def __exit__(self, *_):
        for process in reversed(self.processes):
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
                process.wait()


def told(publisher):
    """The next line of JSON among what roscpp logs."""
    for line in publisher.stdout:
        if line.startswith('{'):
            return json.loads(line)
    sys.exit('the publisher failed')


def digests(bag_path):
    """One for each message of the topic, in order."""
    with rosbag.Bag(str(bag_path)) as bag:
        return [hashlib.md5(raw[1]).hexdigest() for _, raw, _ in
                bag.read_messages(topics=['/load'], raw=True)]


def record(options, load, with_rosbag, folder):
    rate, size = (float(part) for part in load.split('x'))
    store, bag = folder / 'store.db', folder / 'rosbag.bag'
    quiet = {'stdout': subprocess.DEVNULL, 'stderr': subprocess.DEVNULL}
    with Run(options, folder) as run:
        ours = run.start(run.bin / 'recorder_node', f'_store:={store}', '_min_space:=0', **quiet)
        theirs = run.start(rosbag_record(), '-O', bag, '--tcpnodelay', '/load',
                           **quiet) if with_rosbag else None
        publisher = run.start(run.bin / 'record_load', rate, int(size), options.seconds,
                              1 + with_rosbag, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        told(publisher)
        before = {'afterglow': cpu_seconds(ours.pid)}
        if theirs:
            before['rosbag'] = cpu_seconds(theirs.pid)
        begin = time.time()
        publisher.stdin.write('\n')
        publisher.stdin.flush()
        report = told(publisher)
        result = {'report': report, 'megabytes': report['published'] * size / 1e6}
        result['afterglow'] = {
            'cpu': cpu_seconds(ours.pid) - before['afterglow'], 'seconds': report['stopped_in'],
            'lost': report['published'] - report['recorded']}
        if theirs:
            theirs.send_signal(signal.SIGINT)
            _, status, usage = os.wait4(theirs.pid, 0)
            theirs.returncode = status
            result['rosbag'] = {'cpu': usage.ru_utime + usage.ru_stime - before['rosbag'],
                                'seconds': time.time() - begin}
        publisher.stdin.close()
        publisher.wait()
    if theirs:
        compare(run, result, store, bag, folder)
    return result


def compare(run, result, store, bag, folder):
    export = folder / 'afterglow.bag'
    subprocess.run([run.bin / 'afterglow', 'export', str(result['report']['behavior']), '--out',
                    str(export), '--store', str(store)], check=True, stdout=subprocess.DEVNULL,
                   cwd=folder)
    ours, theirs = digests(export), digests(bag)
    result['rosbag']['lost'] = result['report']['published'] - len(theirs)
    result['same'] = ours == theirs


def tell(load, result):
    megabytes = result['megabytes']
    print(f'{load}: {result["report"]["published"]} messages, {megabytes:.0f} MB in '
          f'{result["report"]["published_in"]:.1f} s')
    for who in ('afterglow', 'rosbag'):
        if who not in result:
            continue
        figures = result[who]
        print(f'  {who:10} lost {figures["lost"]}, {1000 * figures["cpu"] / megabytes:.2f} ms of CPU '
              f'a MB ({figures["cpu"]:.2f} s), {megabytes / figures["seconds"]:.1f} MB/s')
    if result['afterglow']['lost']:
        print(f'  afterglow counted {result["report"]["dropped"]} as dropped; others had not arrived '
              'when recording was stopped')
    if 'rosbag' in result:
        ours, theirs = result['afterglow'], result['rosbag']
        print(f'  ratio to rosbag: CPU {ours["cpu"] / max(theirs["cpu"], 1e-9):.2f}, MB/s '
              f'{theirs["seconds"] / ours["seconds"]:.3f}; the same bytes in the same order: '
              f'{"yes" if result["same"] else "NO"}')


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--build', default='build')
    parser.add_argument('--seconds', type=float, default=20)
    parser.add_argument('--folder', help='where both write; default: a temporary one')
    parser.add_argument('--alone', action='store_true', help='recorder_node without rosbag')
    parser.add_argument('loads', nargs='*', default=['1000x1024', '30x1000000'])
    options = parser.parse_args()
    lost = 0
    for load in options.loads:
        with tempfile.TemporaryDirectory(dir=options.folder) as folder:
            result = record(options, load, not options.alone, Path(folder))
        tell(load, result)
        lost += result['afterglow']['lost']
    return 1 if lost else 0


if __name__ == '__main__':
    sys.exit(main())
