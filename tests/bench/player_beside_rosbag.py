#!/usr/bin/env python3
"""How exactly afterglow, rosbag play and the timing scheme of mongodb_play keep a recording's rhythm.

    player_beside_rosbag.py REPLAY_TIMING [seconds] [rounds]

REPLAY_TIMING is the benchmark of that name (AFTERGLOW_BUILD_BENCHMARKS): an independent C++
subscriber that plays the same messages with each player in turn. It is run four times: idle and with
two busy processes, with normal scheduling and, where that is permitted, with SCHED_FIFO for all
players and the subscriber. Behind each run's figures stand, for each stream and player, the median
of the rounds' p99 and the largest drift. Needs a ROS installation and a machine with nothing else to do.

    player_beside_rosbag.py --play-scheme BAG

plays a bag by the scheme of mongodb_play as it is known (a process a topic that sleeps in simulated
time until its next message; a clock that adds 1 ms in each turn of a nominally 1 kHz loop; 2 s of
pre-roll), written anew and without a database.
"""
import multiprocessing
import os
import queue
import subprocess
import sys
import threading
import time

PRE_ROLL_S = 2.0
STEP_S = 0.001


def play_topic(bag_path, topic, ready, begin):
    import rosbag
    import rospy

    messages = queue.Queue(maxsize=50)

    def read():
        for _, message, stamp in rosbag.Bag(bag_path).read_messages(topics=[topic]):
            messages.put((message, stamp))
        messages.put(None)

    threading.Thread(target=read, daemon=True).start()
    first = messages.get()
    rospy.init_node("play_" + topic.strip("/").replace("/", "_"))
    publisher = rospy.Publisher(topic, type(first[0]), queue_size=10)
    ready.release()
    begin.wait()
    while rospy.get_rostime().is_zero():  # the clock's first tick
        time.sleep(STEP_S)
    item = first
    while item is not None and not rospy.is_shutdown():
        message, stamp = item
        wait = stamp - rospy.get_rostime()
        if wait > rospy.Duration(0):
            rospy.sleep(wait)
        publisher.publish(message)
        item = messages.get()


def play_scheme(bag_path):
    import rosbag
    import rosgraph
    import rospy
    from rosgraph_msgs.msg import Clock

    with rosbag.Bag(bag_path) as bag:
        topics = list(bag.get_type_and_topic_info().topics)
        start, end = bag.get_start_time(), bag.get_end_time()
    master = rosgraph.Master("/play_scheme")
    master.setParam("/use_sim_time", True)
    ready, begin = multiprocessing.Semaphore(0), multiprocessing.Event()
    players = [multiprocessing.Process(target=play_topic, args=(bag_path, topic, ready, begin))
               for topic in topics]
    for player in players:
        player.start()
    try:
        for _ in players:
            ready.acquire()
        master.setParam("/use_sim_time", False)  # the clock's own sleep is in real time
        rospy.init_node("play_scheme_clock")
        publisher = rospy.Publisher("/clock", Clock, queue_size=1)
        rate = rospy.Rate(1.0 / STEP_S)
        now = start - PRE_ROLL_S
        begin.set()
        while now <= end + 1.0 and not rospy.is_shutdown():
            publisher.publish(Clock(clock=rospy.Time.from_sec(now)))
            rate.sleep()
            now += STEP_S
        for player in players:
            player.join()
    finally:
        for player in players:
            player.terminate()
        master.deleteParam("/use_sim_time")


def measure(title, timing, seconds, rounds, scheduling, busy):
    print("\n%s, %s scheduling" % (title, scheduling), flush=True)
    load = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(busy)]
    third = [sys.executable, os.path.abspath(__file__), "--play-scheme"]
    command = [timing, seconds, rounds, scheduling] + third
    try:
        subprocess.run((["chrt", "-f", "20"] if scheduling == "fifo" else []) + command, check=True)
    finally:
        for process in load:
            process.kill()
            process.wait()


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    if sys.argv[1] == "--play-scheme":
        play_scheme(sys.argv[2])
        return
    seconds, rounds = (sys.argv[2:4] + ["12", "3"][len(sys.argv) - 2:])[:2]
    permitted = subprocess.run(["chrt", "-f", "20", "true"], stderr=subprocess.DEVNULL).returncode == 0
    print("the third player is mongodb_play's timing scheme; SCHED_FIFO is %s here"
          % ("permitted" if permitted else "not permitted"))
    for title, busy in (("idle", 0), ("two busy processes", 2)):
        for scheduling in ["normal"] + (["fifo"] if permitted else []):
            measure(title, sys.argv[1], seconds, rounds, scheduling, busy)


if __name__ == "__main__":
    main()
