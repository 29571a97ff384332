#!/usr/bin/python3
"""Frames a second of RViz and of projector_node, of the same clouds on the same machine, one after the other.

frame_rates.py OUT [--bin build/bin] [--seconds 10] [--points 100000 307200]

Clouds of 3 px points, 1920x1080, new at 30 Hz. Neither is held back: RViz's Frame Rate and ~rate stand at 240. RViz's
frames are counted as they reach the X server (the Damage extension), ours by /diagnostics (drawn_hz). Everything runs on
the machine's own cores, the publisher too; the load before is printed, since a busy machine measures nothing.
"""
import argparse
import itertools
import os
import select
import sys
import threading
import time

import stage

WIDTH, HEIGHT = 1920, 1080
EYE, PITCH = (-1.8, 0.0, 1.0), 0.45
PUBLISHED_HZ, RATE = 30, 240
SAME_FRAME_S = 0.002  # a frame may reach the server in several pieces


def cloud(count):
    """A wavy sheet that fills the picture: x, y, z, rgb; 16 bytes a point."""
    import numpy
    from sensor_msgs.msg import PointCloud2, PointField
    columns = int((count * 4 / 3) ** 0.5)
    i = numpy.arange(count)
    across, along = i % columns / columns - 0.5, i // columns / (count / columns)
    points = numpy.zeros(count, dtype=[("x", "f4"), ("y", "f4"), ("z", "f4"), ("rgb", "u4")])
    points["x"], points["y"] = 2.5 * along - 0.8, 2.2 * across
    points["z"] = 0.1 * numpy.sin(9 * across) * numpy.cos(7 * along)
    points["rgb"] = (i * 2654435761) & 0xffffff
    message = PointCloud2(height=1, width=count, point_step=16, row_step=16 * count, data=points.tobytes())
    message.header.frame_id = "map"
    message.fields = [PointField(name, 4 * k, 6 if name == "rgb" else 7, 1) for k, name in enumerate(points.dtype.names)]
    return message


class Publishing:
    """A cloud, again and again, from a process of its own, until the `with` block ends."""

    def __init__(self, set_up, count):
        self.set_up, self.count = set_up, count

    def __enter__(self):
        self.process = self.set_up.start("cloud", [sys.executable, os.path.abspath(__file__), "--publish",
                                                   str(self.count), "-"])

    def __exit__(self, *unused):
        self.set_up.end(self.process)


def publish(count):
    import rospy
    from sensor_msgs.msg import PointCloud2
    rospy.init_node("cloud")
    publisher = rospy.Publisher("/cloud", PointCloud2, queue_size=1)
    message, rate = cloud(count), rospy.Rate(PUBLISHED_HZ)
    # The last point is there in every other message: what does not change need not be drawn.
    images = itertools.cycle((message.data, message.data[:-16] + message.data[:16]))
    while not rospy.is_shutdown():
        message.data = next(images)
        publisher.publish(message)
        rate.sleep()


def count_shown(seconds):
    """Frames that reach the X server's screen, a second."""
    from Xlib import display
    from Xlib.ext import damage
    server = display.Display()
    if not server.has_extension("DAMAGE"):
        sys.exit("this X server has no Damage extension")
    server.damage_query_version()
    widest = picture_of(server.screen().root)
    widest.damage_create(damage.DamageReportRawRectangles)
    server.sync()
    frames, last, begin = 0, 0.0, time.monotonic()
    while (now := time.monotonic()) - begin < seconds:
        if not server.pending_events():
            select.select([server], [], [], 0.05)
            continue
        event = server.next_event()
        if event.type == server.extension_event.DamageNotify and event.area.width > WIDTH // 2:
            frames += now - last > SAME_FRAME_S
            last = now
    server.close()
    return frames / (now - begin)


def picture_of(root):
    """The window RViz draws into: the innermost that fills the screen."""
    window = root
    while True:
        fills = [child for child in window.query_tree().children if child.get_geometry().width == WIDTH]
        if not fills:
            return window
        window = fills[-1]


def rviz_rate(out, count, seconds):
    with stage.Stage(out, WIDTH, HEIGHT) as set_up:
        set_up.start_rviz([{
            "Class": "rviz/PointCloud2", "Name": "cloud", "Enabled": True, "Value": True, "Topic": "/cloud",
            "Style": "Points", "Size (Pixels)": 3, "Alpha": 1, "Decay Time": 0, "Position Transformer": "XYZ",
            "Color Transformer": "RGB8", "Queue Size": 10}], EYE, PITCH, RATE)
        with Publishing(set_up, count):
            stage.wait_until(lambda: set_up.screenshot().max() > 0, "RViz to draw the cloud")
            time.sleep(2)
            return count_shown(seconds)


def our_rate(out, count, seconds, folder):
    with stage.Stage(out, WIDTH, HEIGHT) as set_up:
        layers = [{"topic": "/cloud", "type": "sensor_msgs/PointCloud2", "style": "points", "size": 3,
                   "color": "rgb8"}]
        set_up.start_projector(folder, layers, RATE)
        helper = set_up.start("listener", [sys.executable, os.path.abspath(__file__), "--listen", str(seconds), out])
        with Publishing(set_up, count):
            helper.wait()
    lines = open(os.path.join(out, "listener.log")).read().split()
    if len(lines) != 2:
        sys.exit("projector_node: " + " ".join(lines) + open(os.path.join(out, "projector.log")).read())
    return float(lines[0]), lines[1]


def listen(seconds):
    """Prints the mean of drawn_hz once the cloud is shown, and who draws."""
    import rospy
    from diagnostic_msgs.msg import DiagnosticArray
    rospy.init_node("listener")
    eye = stage.broadcast_eye(EYE, PITCH)
    rates, done = [], threading.Event()

    def note(message):
        values = {s.name.split(": ")[-1]: {v.key: v.value for v in s.values} for s in message.status}
        if values.get("/cloud", {}).get("shown") != "1":
            return
        rates.append((float(values["projector"]["drawn_hz"]), values["projector"]["renderer"].replace(" ", "_")))
        if len(rates) >= seconds + 3:
            done.set()

    subscriber = rospy.Subscriber("/diagnostics", DiagnosticArray, note)
    done.wait(seconds + 30)
    steady = rates[2:]
    print(sum(rate for rate, _ in steady) / max(1, len(steady)), steady[-1][1] if steady else "nothing_shown")
    del eye, subscriber


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("--bin", default=os.path.join(os.path.dirname(__file__), "../../build/bin"))
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--points", type=int, nargs="+", default=[100000, 307200])
    parser.add_argument("--publish", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--listen", type=float, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.publish:
        return publish(options.publish)
    if options.listen:
        return listen(options.listen)
    stage.require(options.bin, {"Xlib": "python3-xlib"})
    out = os.path.abspath(options.out)
    print(f"load before: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    for count in options.points:
        rviz = rviz_rate(out, count, options.seconds)
        ours, painter = our_rate(out, count, options.seconds, options.bin)
        print(f"{count:7} points {WIDTH}x{HEIGHT}: RViz {rviz:.1f} Hz, projector_node {ours:.1f} Hz, "
              f"ratio {ours / max(rviz, 0.01):.1f}   ({painter})", flush=True)


if __name__ == "__main__":
    sys.exit(main())
