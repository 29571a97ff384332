"""What a robot's sensors and planners publish at their usual rates: the load of tests/bench/soak.

    soak_load.py POINTS      from a process of its own

/soak/cloud (10 Hz), /soak/markers (5 Hz: standing, moving, with lifetimes, deleted, tied to a
frame, in namespaces that come and go), /soak/path (2 Hz) and, on /tf, a person who walks (50 Hz).
"""
import io
import math
import struct
import sys
import time

HZ = 50
CLOUD_EVERY, MARKERS_EVERY, PATH_EVERY = 5, 10, 25
CLOUDS = 8  # in turn; serialized beforehand, since Python is slow at that
SPARKS, SPARK_NAMES = 5, 1000
CLEARED_EVERY = 100  # arrays


def clouds(points):
    import numpy
    from sensor_msgs.msg import PointCloud2, PointField

    class Serialized(PointCloud2):
        __slots__ = ["bytes"]

        def serialize(self, buff):
            buff.write(self.bytes)

    columns = int(points**0.5)
    index = numpy.arange(points)
    made = []
    for k in range(CLOUDS):
        sheet = numpy.zeros(points, [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4")])
        sheet["x"] = (index % columns / columns - 0.5) * 2
        sheet["y"] = (index // columns / columns - 0.5) * 2
        sheet["z"] = 0.1 * numpy.sin(9 * sheet["x"] + k)
        sheet["rgb"] = (index * 2654435761 + k) & 0xffffff
        cloud = PointCloud2(width=points,
                            height=1,
                            point_step=16,
                            row_step=16 * points,
                            is_dense=True,
                            data=sheet.tobytes())
        cloud.header.frame_id = "map"
        cloud.fields = [
            PointField(name, 4 * i, PointField.FLOAT32, 1)
            for i, name in enumerate(sheet.dtype.names)
        ]
        buffer = io.BytesIO()
        cloud.serialize(buffer)
        made.append(Serialized())
        made[-1].bytes = bytearray(buffer.getvalue())
    return made


def stamped(cloud, now):
    """The stamp stands behind the header's sequence number."""
    cloud.bytes[4:12] = struct.pack("<II", now.secs, now.nsecs)
    return cloud


def marker(kind, space, number, now, x=0.0, y=0.0, frame="map", lifetime=0.0):
    import rospy
    from visualization_msgs.msg import Marker
    made = Marker(type=kind, ns=space, id=number, action=Marker.ADD)
    made.header.frame_id, made.header.stamp = frame, now
    made.pose.position.x, made.pose.position.y, made.pose.orientation.w = x, y, 1
    made.scale.x = made.scale.y = made.scale.z = 0.06
    made.color.r, made.color.g, made.color.b, made.color.a = 0.2, 0.9, (number % 10) / 10, 1
    made.lifetime = rospy.Duration(lifetime)
    return made


def markers(turn, now):
    from visualization_msgs.msg import Marker, MarkerArray
    if turn % CLEARED_EVERY == CLEARED_EVERY - 1:
        return MarkerArray([Marker(action=Marker.DELETEALL)])
    around = [2 * math.pi * (i / 20 + turn / 200) for i in range(20)]
    array = [
        marker(Marker.CUBE, "boxes", i, now, math.cos(a), math.sin(a)) for i, a in enumerate(around)
    ]
    array += [
        marker(Marker.SPHERE,
               "sparks", (turn * SPARKS + i) % SPARK_NAMES,
               now,
               0.1 * i,
               0.8,
               lifetime=1) for i in range(SPARKS)
    ]
    words = marker(Marker.TEXT_VIEW_FACING, f"words {turn // 50}", 0, now, -0.8, -0.6, lifetime=5)
    words.text, words.scale.z = f"turn {turn}", 0.1
    person = marker(Marker.ARROW, "person", 0, now, frame="soak_person")
    person.frame_locked, person.scale.x = True, 0.3
    gone = marker(Marker.CUBE, "boxes", turn % 20, now)
    gone.action = Marker.DELETE
    return MarkerArray(array + [words, person, gone])


def path(turn, now):
    from geometry_msgs.msg import PoseStamped
    from nav_msgs.msg import Path
    made = Path()
    made.header.frame_id, made.header.stamp = "map", now
    for i in range(60):
        pose = PoseStamped()
        pose.header = made.header
        pose.pose.position.x, pose.pose.position.y = i / 30 - 1, 0.3 * math.sin(i / 8 + turn / 5)
        pose.pose.orientation.w = 1
        made.poses.append(pose)
    return made


def person(tick, now):
    from geometry_msgs.msg import TransformStamped
    from tf2_msgs.msg import TFMessage
    there = TransformStamped(child_frame_id="soak_person")
    there.header.frame_id, there.header.stamp = "map", now
    angle = 2 * math.pi * tick / (HZ * 20)
    there.transform.translation.x, there.transform.translation.y = 0.7 * math.cos(
        angle), 0.4 * math.sin(angle)
    there.transform.rotation.z, there.transform.rotation.w = math.sin(angle / 2), math.cos(angle /
                                                                                           2)
    return TFMessage([there])


def main():
    import rospy
    from nav_msgs.msg import Path
    from sensor_msgs.msg import PointCloud2
    from tf2_msgs.msg import TFMessage
    from visualization_msgs.msg import MarkerArray
    rospy.init_node("soak_load")
    made = clouds(int(sys.argv[1]))
    cloud_topic = rospy.Publisher("/soak/cloud", PointCloud2, queue_size=1, tcp_nodelay=True)
    marker_topic = rospy.Publisher("/soak/markers", MarkerArray, queue_size=10)
    path_topic = rospy.Publisher("/soak/path", Path, queue_size=10)
    tf_topic = rospy.Publisher("/tf", TFMessage, queue_size=100)
    begin, tick = time.monotonic(), 0
    while not rospy.is_shutdown():
        now = rospy.Time.now()
        tf_topic.publish(person(tick, now))
        if tick % CLOUD_EVERY == 0:
            cloud_topic.publish(stamped(made[tick // CLOUD_EVERY % CLOUDS], now))
        if tick % MARKERS_EVERY == 0:
            marker_topic.publish(markers(tick // MARKERS_EVERY, now))
        if tick % PATH_EVERY == 0:
            path_topic.publish(path(tick // PATH_EVERY, now))
        tick += 1
        time.sleep(max(0.0, begin + tick / HZ - time.monotonic()))


if __name__ == "__main__":
    main()
