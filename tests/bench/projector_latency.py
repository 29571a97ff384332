#!/usr/bin/python3
"""From a message's publication to the picture that shows it on projector_node's image topic.

Starts a roscore and a projector_node of its own, publishes a marker or a cloud of a new color 30
times a second, and waits for that color in the picture's middle. Python's own time is included.
Then whose the time is: the node's stages as its /diagnostics tell them, of the last seconds (of a
cloud: 'arrived' is from the publication), and 'seen', from a picture's beginning to here: what
exceeds composed, drawn and published of it is the way here and Python's.
Exits with 1 if the 99th percentile exceeds --limit-ms (a frame at 30 Hz), or, with --memory, if the
node's memory grows by more than 1 MiB from the middle of the run to its end.

  tests/bench/projector_latency.py                       markers at 1280x800
  tests/bench/projector_latency.py --cloud 307200        a depth camera's clouds
  tests/bench/projector_latency.py --memory 10           both, for ten minutes
"""
import argparse
import os
import random
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

CODES = 32  # colors in turn; what takes longer than half of them counts as the next round
TILT = (1, 0, 0, 0)  # the projector looks straight down


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--node", default="build/bin/projector_node")
    parser.add_argument("--size", default="1280x800", help="of the picture")
    parser.add_argument("--cloud", type=int, default=0, metavar="POINTS",
                        help="publish clouds of so many points instead of markers")
    parser.add_argument("--messages", type=int, default=600)
    parser.add_argument("--hz", type=float, default=30)
    parser.add_argument("--limit-ms", type=float, default=1000 / 30)
    parser.add_argument("--memory", type=float, default=0, metavar="MINUTES")
    return parser.parse_args()


def write_configuration(folder, width, height, count):
    size = max(3, int((width * height / count) ** 0.5) + 1) if count else 3  # px, without gaps
    with open(os.path.join(folder, "lens.yaml"), "w") as file:
        file.write(f"""image_width: {width}
image_height: {height}
camera_name: projector
camera_matrix: {{rows: 3, cols: 3, data: [{width}, 0, {width / 2}, 0, {width}, {height / 2}, 0, 0, 1]}}
distortion_model: plumb_bob
distortion_coefficients: {{rows: 1, cols: 5, data: [-0.05, 0.01, 0, 0, 0]}}
rectification_matrix: {{rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}}
projection_matrix: {{rows: 3, cols: 4, data: [{width}, 0, {width / 2}, 0, 0, {width}, {height / 2}, 0, 0, 0, 1, 0]}}
""")
    path = os.path.join(folder, "config.yaml")
    with open(path, "w") as file:
        file.write(f"""fixed_frame: map
projector: {{camera_info: lens.yaml, frame: projector}}
layers:
  - {{topic: /marker, type: visualization_msgs/Marker}}
  - {{topic: /cloud, type: sensor_msgs/PointCloud2, style: points, size: {size}, color: rgb8}}
""")
    return path


def start_master(folder):
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        port = probe.getsockname()[1]
    os.environ.update(ROS_MASTER_URI=f"http://localhost:{port}", ROS_HOSTNAME="localhost",
                      ROS_HOME=folder, ROS_LOG_DIR=folder)
    master = subprocess.Popen(["roscore", "-p", str(port)], stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL)
    while True:
        try:
            socket.create_connection(("localhost", port), 1).close()
            return master
        except OSError:
            if master.poll() is not None:
                sys.exit("roscore has ended")
            time.sleep(0.05)


def color_of(code):
    """Four values a channel, high in their range: between points' smoothed edges it is darker."""
    return tuple(((code >> shift) & 3) * 64 + 48 for shift in (0, 2, 4))


def middle_code(buffer):
    """What a serialized sensor_msgs/Image (rgb8) has in its middle."""
    at = 12
    at += 4 + struct.unpack_from("<I", buffer, at)[0]  # frame_id
    height, width = struct.unpack_from("<II", buffer, at)
    at += 8
    at += 4 + struct.unpack_from("<I", buffer, at)[0]  # encoding
    step = struct.unpack_from("<I", buffer, at + 1)[0]
    pixel = at + 9 + height // 2 * step + width // 2 * 3
    r, g, b = buffer[pixel:pixel + 3]
    return (r >> 6) | (g >> 6) << 2 | (b >> 6) << 4


def stamp_of(buffer):
    """Of a serialized header, s."""
    seconds, nanoseconds = struct.unpack_from("<II", buffer, 4)
    return seconds + nanoseconds / 1e9


class Watch:
    """When which color was first published and seen."""

    def __init__(self):
        self.lock = threading.Lock()
        self.waiting = {}  # code -> time of publication
        self.latencies = []
        self.picture_ages = []  # s, since their drawing has begun
        self.stages = {}
        self.pictures = 0

    def publish(self, code, send):
        with self.lock:
            self.waiting[code] = time.monotonic()
        send(code)

    def see(self, message):
        now = time.monotonic()
        age = time.time() - stamp_of(message._buff)
        seen = middle_code(message._buff)
        with self.lock:
            self.pictures += 1
            self.picture_ages.append(age)
            # A later color answers for those before it, which it has replaced.
            for code in [c for c in self.waiting if (seen - c) % CODES < CODES // 2]:
                self.latencies.append(now - self.waiting.pop(code))


    def hear(self, diagnostics):
        for status in diagnostics.status:
            for value in status.values:
                if value.key.startswith("time: "):
                    self.stages[value.key[len("time: "):]] = value.value


def transform(rospy):
    from geometry_msgs.msg import TransformStamped
    from tf2_msgs.msg import TFMessage
    down = TransformStamped()
    down.header.frame_id, down.child_frame_id = "map", "projector"
    down.transform.translation.z = 2
    (down.transform.rotation.x, down.transform.rotation.y, down.transform.rotation.z,
     down.transform.rotation.w) = TILT
    publisher = rospy.Publisher("/tf_static", TFMessage, latch=True, queue_size=1)
    publisher.publish(TFMessage([down]))
    return publisher


def marker_sender(rospy):
    from visualization_msgs.msg import Marker
    marker = Marker(type=Marker.CUBE)
    marker.header.frame_id = "map"
    marker.pose.orientation.w = marker.color.a = 1
    marker.scale.x = marker.scale.y = 0.5
    marker.scale.z = 0.01
    publisher = rospy.Publisher("/marker", Marker, queue_size=1, tcp_nodelay=True)

    def send(code):
        marker.color.r, marker.color.g, marker.color.b = (c / 255 for c in color_of(code))
        publisher.publish(marker)
    return publisher, send


def cloud_sender(rospy, count, width, height):
    """All clouds are serialized beforehand: Python is slow at that."""
    import io
    import numpy
    from sensor_msgs.msg import PointCloud2, PointField

    class Serialized(PointCloud2):
        __slots__ = ["bytes"]

        def serialize(self, buff):
            now = time.time()
            buff.write(self.bytes[:4])
            buff.write(struct.pack("<II", int(now), int(now % 1 * 1e9)))
            buff.write(memoryview(self.bytes)[12:])

    columns = int((count * width / height) ** 0.5)
    points = numpy.zeros(count, [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4")])
    index = numpy.arange(count)
    points["x"] = (index % columns / columns - 0.5) * 2
    points["y"] = (index // columns / (count / columns) - 0.5) * 2 * height / width
    cloud = PointCloud2(width=count, height=1, point_step=16, row_step=16 * count, is_dense=True)
    cloud.header.frame_id = "map"
    cloud.fields = [PointField(name, 4 * i, PointField.FLOAT32, 1)
                    for i, name in enumerate(("x", "y", "z", "rgb"))]
    messages = []
    for code in range(CODES):
        r, g, b = color_of(code)
        points["rgb"] = r << 16 | g << 8 | b
        cloud.data = points.tobytes()
        buffer = io.BytesIO()
        cloud.serialize(buffer)
        messages.append(Serialized())
        messages[-1].bytes = buffer.getvalue()
    publisher = rospy.Publisher("/cloud", PointCloud2, queue_size=1, tcp_nodelay=True)
    return publisher, lambda code: publisher.publish(messages[code])


def resident_bytes(pid):
    with open(f"/proc/{pid}/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def report_latency(watch, limit_ms):
    with watch.lock:
        values = sorted(1000 * latency for latency in watch.latencies[20:])  # the first warm it up
        lost = len(watch.waiting)
    share = lambda part: values[min(len(values) - 1, int(part * len(values)))]
    print(f"latency of {len(values)} messages, ms: p50 {share(0.5):.1f}, p90 {share(0.9):.1f}, "
          f"p99 {share(0.99):.1f}, max {values[-1]:.1f}; {lost} unseen; "
          f"{watch.pictures} pictures")
    return share(0.99) <= limit_ms and lost <= 1


def report_stages(watch):
    ages = sorted(1000 * age for age in watch.picture_ages[20:])
    print("".join(f"  {stage:<10}{times}\n" for stage, times in watch.stages.items()) +
          f"  {'seen':<10}p50 {ages[len(ages) // 2]:.1f}, p99 {ages[len(ages) * 99 // 100]:.1f} ms")


def report_memory(samples):
    half = samples[len(samples) // 2:]
    mean = lambda pairs: sum(bytes for _, bytes in pairs) / len(pairs)
    quarter = max(1, len(half) // 4)
    grown = (mean(half[-quarter:]) - mean(half[:quarter])) / 2**20
    begin, end = half[0][0], half[-1][0]
    print(f"memory, MiB: {samples[0][1] / 2**20:.1f} at the start, {half[0][1] / 2**20:.1f} in the "
          f"middle, {half[-1][1] / 2**20:.1f} at the end; {grown:+.2f} MiB in the last "
          f"{(end - begin) / 60:.1f} minutes")
    return grown <= 1


def run(arguments, folder):
    width, height = (int(number) for number in arguments.size.split("x"))
    count = arguments.cloud or (100000 if arguments.memory else 0)
    config = write_configuration(folder, width, height, count)
    node = subprocess.Popen([arguments.node, f"_config:={config}", "_window:=false"])
    try:
        import rospy
        from diagnostic_msgs.msg import DiagnosticArray
        rospy.init_node("latency", disable_signals=True)
        kept = [transform(rospy)]
        watch = Watch()
        senders = []
        if count:
            senders.append(cloud_sender(rospy, count, width, height))
        if not arguments.cloud:
            senders.append(marker_sender(rospy))
        kept.append(rospy.Subscriber("/projector_node/image", rospy.AnyMsg, watch.see,
                                     buff_size=1 << 24, tcp_nodelay=True))
        kept.append(rospy.Subscriber("/diagnostics", DiagnosticArray, watch.hear))
        while watch.pictures == 0 or any(p.get_num_connections() == 0 for p, _ in senders):
            if node.poll() is not None:
                sys.exit("projector_node has ended")
            time.sleep(0.05)
        messages = int(arguments.memory * 60 * arguments.hz) or arguments.messages
        samples = []
        due = time.monotonic()
        for number in range(messages):
            for _, send in senders:
                watch.publish(number % CODES, send)
            if number % int(arguments.hz) == 0:
                samples.append((time.monotonic(), resident_bytes(node.pid)))
                if node.poll() is not None:
                    sys.exit("projector_node has ended")
            due += 1 / arguments.hz
            time.sleep(max(0, due + random.uniform(-0.003, 0.003) - time.monotonic()))
        time.sleep(1)
        is_good = report_latency(watch, arguments.limit_ms)
        report_stages(watch)
        return report_memory(samples) and is_good if arguments.memory else is_good
    finally:
        node.terminate()
        node.wait()


def main():
    arguments = parse_arguments()
    with tempfile.TemporaryDirectory() as folder:
        master = start_master(folder)
        try:
            return 0 if run(arguments, folder) else 1
        finally:
            master.terminate()
            master.wait()


if __name__ == "__main__":
    sys.exit(main())
