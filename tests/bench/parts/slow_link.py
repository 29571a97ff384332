#!/usr/bin/env python3
"""A second machine on this one: a network namespace, and packets that come late to it and get lost.

    slow_link.py NAMESPACE HERE THERE --delay MS --loss PERCENT     as root; addresses of a /24

Between two TUN devices, one here and one in the namespace, this relays each packet, both ways alike. "ready" on
stdout: it is there. On stdin "down" and "up" cut and mend it; its end takes the namespace away.
"""
import argparse
import collections
import fcntl
import os
import random
import select
import struct
import subprocess
import sys
import time

TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 0x0001, 0x1000
MOST_WAITING = 2000  # packets; what a router would hold, and drop beyond


def ip(*words):
    subprocess.run(["ip", *words], check=True)


def device(name):
    tun = os.open("/dev/net/tun", os.O_RDWR)
    fcntl.ioctl(tun, TUNSETIFF, struct.pack("16sH", name.encode(), IFF_TUN | IFF_NO_PI))
    return tun


def connect(space, here, there):
    """A device moves to another namespace without the file that its packets come from."""
    subprocess.run(["ip", "netns", "del", space], stderr=subprocess.DEVNULL)
    near, far = device("agl0"), device("agl1")
    ip("netns", "add", space)
    ip("link", "set", "agl1", "netns", space)
    ip("addr", "add", here + "/24", "dev", "agl0")
    ip("link", "set", "agl0", "up")
    ip("-n", space, "addr", "add", there + "/24", "dev", "agl1")
    for name in ("agl1", "lo"):
        ip("-n", space, "link", "set", name, "up")
    return near, far


def relay(near, far, delay_s, loss):
    chance, waiting, is_up = random.Random(1), collections.deque(), True
    other = {near: far, far: near}
    while True:
        patience = max(0.0, waiting[0][0] - time.monotonic()) if waiting else None
        for source in select.select([near, far, sys.stdin], [], [], patience)[0]:
            if source is sys.stdin:
                word = sys.stdin.readline().strip()
                if not word:
                    return
                is_up = word == "up"
                continue
            packet = os.read(source, 65536)
            if is_up and chance.random() >= loss and len(waiting) < MOST_WAITING:
                waiting.append((time.monotonic() + delay_s, other[source], packet))
        while waiting and waiting[0][0] <= time.monotonic():
            _, target, packet = waiting.popleft()
            os.write(target, packet)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("namespace")
    parser.add_argument("here")
    parser.add_argument("there")
    parser.add_argument("--delay", type=float, default=50, help="ms, each way")
    parser.add_argument("--loss", type=float, default=1, help="percent, each way")
    options = parser.parse_args()
    near, far = connect(options.namespace, options.here, options.there)
    try:
        print("ready", flush=True)
        relay(near, far, options.delay / 1000, options.loss / 100)
    finally:
        ip("netns", "del", options.namespace)


if __name__ == "__main__":
    main()
