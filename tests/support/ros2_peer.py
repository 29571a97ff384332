"""A node of ROS 2 (rclpy) that does what a test of another Python says: lines of JSON in, lines of JSON out.

Each line in is Python code; what it leaves in `answer` is the line out. It may call:"""
import importlib
import json
import os
import sys
import threading
import traceback

import rclpy
from rclpy.duration import Duration
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy


def qos(reliable=True, latched=False, depth=1000, deadline_s=0):
    return QoSProfile(depth=depth, deadline=Duration(seconds=deadline_s),
                      reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
                      durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE)


def message(name, **fields):
    """message("std_msgs/String", data="hello")"""
    package, kind = name.split("/")
    return getattr(importlib.import_module(package + ".msg"), kind)(**fields)


def publisher(topic, name, **quality):
    return node.create_publisher(type(message(name)), topic, qos(**quality))


def hear(topic, name, **quality):
    """A list that grows."""
    heard = []
    node.create_subscription(type(message(name)), topic, heard.append, qos(**quality))
    return heard


def subscribers(topic):
    return node.count_subscribers(topic)


if "first" in sys.argv[2:]:  # it goes before what makes the machine busy, where that is permitted
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(5))
    except PermissionError:
        pass
rclpy.init(args=sys.argv[2:])
node = rclpy.create_node(sys.argv[1])
# What hears much, or is timed, wants one thread: rclpy's executor with two spends 46 ms on one message of a hundred.
executor = SingleThreadedExecutor() if "one-thread" in sys.argv[2:] else MultiThreadedExecutor(2)
executor.add_node(node)
threading.Thread(target=executor.spin, daemon=True).start()
names = dict(globals())
print("{}", flush=True)
for line in sys.stdin:
    names["answer"] = None
    try:
        exec(json.loads(line), names)
        print(json.dumps({"answer": names["answer"]}), flush=True)
    except Exception:
        print(json.dumps({"error": traceback.format_exc()}), flush=True)
