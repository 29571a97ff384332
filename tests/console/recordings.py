"""Stores for tests and benchmarks of the console, made by the real tools: bags of what a robot does, imported."""
import os
import subprocess
import sys

sys.path[:0] = ["/usr/lib/python3/dist-packages"]

import rosbag  # noqa: E402
import rospy  # noqa: E402
from geometry_msgs.msg import Twist  # noqa: E402
from sound_play.msg import SoundRequest  # noqa: E402
from visualization_msgs.msg import Marker, MarkerArray  # noqa: E402

BEGIN_S = 1_790_000_000  # 2026-09-21


def write_bag(path, begin_s, length_s, words, speed=0.2, hz=10, more=()):
    """A drive with light and speech: velocities, markers twice a second, sentences evenly over it."""
    with rosbag.Bag(path, "w") as bag:
        for at in range(int(length_s * hz) + 1):
            bag.write("/cmd_vel", twist(speed), rospy.Time.from_sec(begin_s + at / hz))
        for at in range(int(length_s * 2)):
            bag.write("/projector/nav/path", markers(at), rospy.Time.from_sec(begin_s + 0.1 + at / 2))
        for at, text in enumerate(words):
            said = SoundRequest(sound=SoundRequest.SAY, command=SoundRequest.PLAY_ONCE, volume=1, arg=text)
            bag.write("/robotsound", said, rospy.Time.from_sec(begin_s + (at + 1) * length_s / (len(words) + 1)))
        for topic, message in more:
            bag.write(topic, message, rospy.Time.from_sec(begin_s + 0.5))


def twist(speed):
    message = Twist()
    message.linear.x = speed
    return message


def markers(at):
    marker = Marker(type=Marker.SPHERE, action=Marker.ADD, id=1)
    marker.header.frame_id = "map"
    marker.pose.position.x, marker.pose.orientation.w = 0.1 * at, 1
    marker.scale.x = marker.scale.y = marker.scale.z = 0.1
    marker.color.g = marker.color.a = 1
    return MarkerArray(markers=[marker])


def import_bags(command, store, paths, *options):
    subprocess.run([command, "import", *paths, "--store", store, *options], check=True, stdout=subprocess.DEVNULL)


def small_store(command, folder):
    """Four behaviors: 1 pick, 2 pick that says another thing, 3 drive, 4 one whose name and words are markup."""
    store = os.path.join(folder, "store.db")
    hostile = "<img src=x onerror=\"document.title='broken in'\">"
    for name, begin, length, words, speed in (
            ("pick", 0, 8, ["I pick the gearbox bottom.", "I have it."], 0.2),
            ("pick", 3600, 10, ["I pick the gearbox bottom.", "I dropped it."], 0.3),
            ("drive", 2 * 86400, 6, ["I drive round the box."], 0.5),
            (hostile, 3 * 86400, 2, [hostile], 0.1)):
        path = os.path.join(folder, "one.bag")
        write_bag(path, BEGIN_S + begin, length, words, speed)
        import_bags(command, store, [path], "--name", name, *(["--tag", hostile] if name == hostile else []))
    return store
