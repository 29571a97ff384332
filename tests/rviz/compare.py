#!/usr/bin/python3
"""Every marker type, cloud style, path style and other layer as RViz draws it and as projector_node does.

compare.py OUT [--bin build/bin] [--only NAME]    OUT/sheet.png: pairs, RViz left, ours right; OUT/NAME.png: one pair

Prints how far what is lit overlaps, intersection over union. What differs, and why, is in render/README.md.
Needs RViz, Xvfb and ImageMagick beside what the tests need; says so where they are missing.
"""
import argparse
import os
import struct
import sys
import time

import stage

WIDTH, HEIGHT = 640, 480
EYE, PITCH = (-1.8, 0.0, 1.0), 0.45
LIT = 20  # of 255; less is black
# RViz shades these, so that only what is lit at all can be compared; of the others every pixel's brightness is.
SHADED = ("arrow", "cube", "sphere", "cylinder", "mesh", "cloud_spheres", "cloud_boxes", "path_axes", "path_arrows",
          "pose", "odometry", "range")


# ------------------------------------------------------------------------------------------------ what is shown
def marker(kind, points=(), scale=(0.3, 0.3, 0.3), color=(0.2, 1.0, 0.2), at=(0.0, 0.0, 0.2), **more):
    from geometry_msgs.msg import Point
    from visualization_msgs.msg import Marker
    m = Marker(type=kind, id=0, **more)
    m.header.frame_id = "map"
    m.pose.position.x, m.pose.position.y, m.pose.position.z = at
    m.pose.orientation.z, m.pose.orientation.w = 0.3826834, 0.9238795  # 45 degrees: no side is seen from its edge
    m.scale.x, m.scale.y, m.scale.z = scale
    m.color.r, m.color.g, m.color.b, m.color.a = (*color, 1)[:4]
    m.points = [Point(*p) for p in points]
    return m


def rainbow(count):
    from std_msgs.msg import ColorRGBA
    colors = [(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (1, 0, 1)]
    return [ColorRGBA(*colors[i % 6], 1) for i in range(count)]


CORNERS = [(-0.5, -0.4, 0), (-0.2, 0.4, 0.1), (0.1, -0.4, 0.2), (0.4, 0.4, 0.3), (0.6, -0.4, 0.1), (0.7, 0.1, 0.4)]


def markers(out):
    """name -> Marker"""
    from visualization_msgs.msg import Marker as M
    stl, dae = write_meshes(out)
    triangles = [CORNERS[i] for i in (0, 1, 2, 1, 2, 3, 2, 3, 4)]
    return {
        "arrow": marker(M.ARROW, scale=(0.8, 0.1, 0.1)),
        "arrow_flat": marker(M.ARROW, scale=(0.8, 0.2, 0.05)),
        "arrow_points": marker(M.ARROW, CORNERS[1:3], scale=(0.06, 0.15, 0.2)),
        "cube": marker(M.CUBE, scale=(0.6, 0.4, 0.2)),
        "sphere": marker(M.SPHERE, scale=(0.7, 0.4, 0.3)),
        "cylinder": marker(M.CYLINDER, scale=(0.5, 0.3, 0.4)),
        "line_strip": marker(M.LINE_STRIP, CORNERS, scale=(0.04, 0, 0), colors=rainbow(6)),
        "line_list": marker(M.LINE_LIST, CORNERS, scale=(0.04, 0, 0)),
        "cube_list": marker(M.CUBE_LIST, CORNERS, scale=(0.15, 0.1, 0.2), colors=rainbow(6)),
        "sphere_list": marker(M.SPHERE_LIST, CORNERS, scale=(0.15, 0.15, 0.15), colors=rainbow(6)),
        "points": marker(M.POINTS, CORNERS, scale=(0.08, 0.04, 0), colors=rainbow(6)),
        "text_view_facing": marker(M.TEXT_VIEW_FACING, scale=(0, 0, 0.2), text="Gearbox Ag\n2nd line"),
        "mesh_resource": marker(M.MESH_RESOURCE, scale=(0.5, 0.5, 0.5), mesh_resource="file://" + stl),
        "mesh_own_colors": marker(M.MESH_RESOURCE, scale=(0.5, 0.5, 0.5), mesh_resource="file://" + dae,
                                  color=(0, 0, 0, 0), mesh_use_embedded_materials=True),
        "mesh_tinted": marker(M.MESH_RESOURCE, scale=(0.5, 0.5, 0.5), mesh_resource="file://" + dae,
                              color=(1, 1, 1), mesh_use_embedded_materials=True),
        "triangle_list": marker(M.TRIANGLE_LIST, triangles, scale=(1, 1, 1), colors=rainbow(9)),
    }


def write_meshes(out):
    """A pyramid on its side, as STL and as Collada (red; y is said to be up, which RViz does not follow)."""
    points = [(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0), (0, 0, 1)]
    faces = [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4), (0, 2, 1), (0, 3, 2)]
    stl, dae = os.path.join(out, "pyramid.stl"), os.path.join(out, "pyramid.dae")
    with open(stl, "w") as file:
        file.write("solid pyramid\n")
        for face in faces:
            file.write("facet normal 0 0 0\nouter loop\n")
            file.writelines("vertex %g %g %g\n" % points[i] for i in face)
            file.write("endloop\nendfacet\n")
        file.write("endsolid pyramid\n")
    with open(dae, "w") as file:
        file.write(COLLADA % (" ".join("%g %g %g" % p for p in points), " ".join("%d %d %d" % f for f in faces)))
    return stl, dae


COLLADA = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="m" meter="1"/><up_axis>Y_UP</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique sid="t"><lambert><ambient><color>1 0 0 1</color></ambient>
<diffuse><color>1 0 0 1</color></diffuse></lambert></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="15">%s</float_array>
<technique_common><accessor source="#pa" count="5" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="6" material="s"><input semantic="VERTEX" source="#v" offset="0"/><p>%s</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s1"><node><instance_geometry url="#g"><bind_material><technique_common>
<instance_material symbol="s" target="#m"/></technique_common></bind_material></instance_geometry></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s1"/></scene></COLLADA>
"""

# name -> (RViz's style, its transformer, our style, our color, size)
CLOUDS = {
    "cloud_points": ("Points", "RGB8", "points", "rgb8", 3),
    "cloud_squares": ("Squares", "RGB8", "squares", "rgb8", 0.03),
    "cloud_flat_squares": ("Flat Squares", "RGB8", "flat_squares", "rgb8", 0.03),
    "cloud_spheres": ("Spheres", "RGB8", "spheres", "rgb8", 0.04),
    "cloud_boxes": ("Boxes", "RGB8", "boxes", "rgb8", 0.03),
    "cloud_flat_color": ("Flat Squares", "FlatColor", "flat_squares", [255, 170, 0], 0.03),
    "cloud_intensity": ("Flat Squares", "Intensity", "flat_squares", "intensity", 0.03),
    "cloud_axis_z": ("Flat Squares", "AxisColor", "flat_squares", "axis_z", 0.03),
}


def cloud():
    """A wavy sheet: x, y, z, rgb, intensity."""
    from sensor_msgs.msg import PointCloud2, PointField
    import math
    data = b""
    rows, columns = 16, 20
    for i in range(rows):
        for j in range(columns):
            x, y = -0.5 + 0.08 * i, -0.7 + 0.07 * j
            rgb = 0xff0000 if (i + j) % 3 == 0 else 0x00ff00 if (i + j) % 3 == 1 else 0x4080ff
            data += struct.pack("<fffIf", x, y, 0.15 * math.sin(5 * x) * math.cos(4 * y), rgb, i * j)
    message = PointCloud2(height=1, width=rows * columns, point_step=20, row_step=20 * rows * columns, data=data)
    message.header.frame_id = "map"
    message.fields = [PointField(name, 4 * k, 6 if name == "rgb" else 7, 1)
                      for k, name in enumerate(("x", "y", "z", "rgb", "intensity"))]
    return message


# name -> (RViz's line style, its pose style, our keys)
PATHS = {
    "path_lines": ("Lines", "None", {"style": "lines"}),
    "path_billboards": ("Billboards", "None", {"style": "billboards"}),
    "path_axes": ("Lines", "Axes", {"style": "lines", "pose_style": "axes"}),
    "path_arrows": ("Lines", "Arrows", {"style": "lines", "pose_style": "arrows"}),
}


def path():
    from geometry_msgs.msg import PoseStamped
    from nav_msgs.msg import Path
    import math
    message = Path()
    message.header.frame_id = "map"
    for i in range(5):
        pose = PoseStamped()
        pose.header.frame_id = "map"
        pose.pose.position.x, pose.pose.position.y = -0.5 + 0.3 * i, 0.4 * math.sin(1.5 * i)
        pose.pose.orientation.z, pose.pose.orientation.w = math.sin(0.4 * i), math.cos(0.4 * i)
        message.poses.append(pose)
    return message


def stamped(message, **fields):
    message.header.frame_id = "map"
    for name, value in fields.items():
        setattr(message, name, value)
    return message


def pose(x=0.0, y=0.0, yaw=0.6):
    import math
    from geometry_msgs.msg import Pose
    message = Pose()
    message.position.x, message.position.y = x, y
    message.orientation.z, message.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
    return message


def spread(message, at):
    message.pose.pose = at
    message.pose.covariance = [0.0] * 36
    for i, value in ((0, 0.09), (1, 0.03), (6, 0.03), (7, 0.04), (35, 0.04)):
        message.pose.covariance[i] = value
    return message


def grid(x=-0.5):
    from nav_msgs.msg import OccupancyGrid
    message = stamped(OccupancyGrid())
    message.info.width = message.info.height = 12
    message.info.resolution, message.info.origin = 0.08, pose(x, -0.5, 0.2)
    message.data = [-1] * 12 + list(range(100)) + [-1] * 18 + [100, 120, -50] + [-1] * 11
    return message


def others():
    """name -> (RViz's class and properties, our type and keys, what to show, what erases it); poses are moved away"""
    from geometry_msgs.msg import Point, Point32, PolygonStamped, PoseArray, PoseStamped, PoseWithCovarianceStamped
    from nav_msgs.msg import GridCells, Odometry
    from sensor_msgs.msg import Range
    away, here = pose(-100), pose()
    polygon = stamped(PolygonStamped())
    polygon.polygon.points = [Point32(*p) for p in CORNERS]
    cells = [Point(0.2 * (i % 4) + 0.05 * (i // 4), 0.1 * (i // 4), 0) for i in range(12)]
    several = [pose(-0.3 + 0.2 * i, -0.4 + 0.2 * i, 0.8 * i) for i in range(5)]
    ranging = dict(field_of_view=0.6, min_range=0.1, max_range=3)
    items = {
        "polygon": ("Polygon", {}, "geometry_msgs/PolygonStamped", {"style": "lines"}, polygon,
                    stamped(PolygonStamped())),
        "pose_arrow": ("Pose", {"Shape": "Arrow"}, "geometry_msgs/PoseStamped", {}, stamped(PoseStamped(), pose=here),
                       stamped(PoseStamped(), pose=away)),
        "pose_axes": ("Pose", {"Shape": "Axes"}, "geometry_msgs/PoseStamped", {"shape": "axes"},
                      stamped(PoseStamped(), pose=here), stamped(PoseStamped(), pose=away)),
        "flat_arrows": ("PoseArray", {"Shape": "Arrow (Flat)"}, "geometry_msgs/PoseArray", {"style": "lines"},
                        stamped(PoseArray(), poses=several), stamped(PoseArray())),
        "poses_arrow": ("PoseArray", {"Shape": "Arrow (3D)"}, "geometry_msgs/PoseArray", {"shape": "arrow"},
                        stamped(PoseArray(), poses=several), stamped(PoseArray())),
        "poses_axes": ("PoseArray", {"Shape": "Axes"}, "geometry_msgs/PoseArray", {"shape": "axes"},
                       stamped(PoseArray(), poses=several), stamped(PoseArray())),
        "pose_with_covariance": ("PoseWithCovariance", {}, "geometry_msgs/PoseWithCovarianceStamped", {},
                                 spread(stamped(PoseWithCovarianceStamped()), here),
                                 spread(stamped(PoseWithCovarianceStamped()), away)),
        "odometry": ("Odometry", {"Keep": 1}, "nav_msgs/Odometry", {"keep": 1}, spread(stamped(Odometry()), here),
                     spread(stamped(Odometry()), away)),
        "grid_cells": ("GridCells", {}, "nav_msgs/GridCells", {},
                       stamped(GridCells(), cells=cells, cell_width=0.2, cell_height=0.1), stamped(GridCells())),
        "range": ("Range", {}, "sensor_msgs/Range", {}, stamped(Range(), range=1.2, **ranging),
                  stamped(Range(), range=5, **ranging)),
    }
    for scheme in ("map", "costmap", "raw"):
        items["grid_" + scheme] = ("Map", {"Color Scheme": scheme, "Alpha": 0.7}, "nav_msgs/OccupancyGrid",
                                   {"color_scheme": scheme}, grid(), grid(-100))
    return items


# ---------------------------------------------------------------------------------------------- how it is configured
def rviz_displays():
    displays = [{"Class": "rviz/MarkerArray", "Name": "markers", "Enabled": True, "Value": True, "Queue Size": 100,
                 "Marker Topic": "/markers", "Namespaces": {}}]
    for name, (style, transformer, _, color, size) in CLOUDS.items():
        displays.append({
            "Class": "rviz/PointCloud2", "Name": name, "Enabled": True, "Value": True, "Topic": "/" + name,
            "Style": style, "Size (Pixels)": 3, "Size (m)": size if size < 1 else 0.01, "Alpha": 1, "Decay Time": 0,
            "Position Transformer": "XYZ", "Color Transformer": transformer, "Queue Size": 10,
            "Color": "; ".join(map(str, color)) if isinstance(color, list) else "255; 255; 255",
            "Axis": "Z", "Channel Name": "intensity", "Use rainbow": True, "Invert Rainbow": False,
            "Autocompute Intensity Bounds": True, "Use Fixed Frame": True,
            "Autocompute Value Bounds": {"Value": True, "Min Value": -10, "Max Value": 10}})
    for name, (line, pose, _) in PATHS.items():
        displays.append({
            "Class": "rviz/Path", "Name": name, "Enabled": True, "Value": True, "Topic": "/" + name, "Alpha": 1,
            "Buffer Length": 1, "Color": "25; 255; 0", "Line Style": line, "Line Width": 0.03, "Pose Style": pose,
            "Pose Color": "255; 85; 255", "Length": 0.3, "Radius": 0.03, "Shaft Length": 0.1, "Head Length": 0.2,
            "Shaft Diameter": 0.1, "Head Diameter": 0.3})
    for name, (kind, properties, *_) in others().items():
        displays.append({"Class": "rviz/" + kind, "Name": name, "Enabled": True, "Value": True, "Topic": "/" + name,
                         **properties})
    return displays


def our_layers():
    layers = [{"topic": "/markers", "type": "visualization_msgs/MarkerArray"}]
    for name, (_, _, style, color, size) in CLOUDS.items():
        layers.append({"topic": "/" + name, "type": "sensor_msgs/PointCloud2", "style": style, "color": color,
                       "size": size})
    for name, (_, _, keys) in PATHS.items():
        layers.append({"topic": "/" + name, "type": "nav_msgs/Path", "color": [25, 255, 0], **keys})
    for name, (_, _, kind, keys, *_) in others().items():
        layers.append({"topic": "/" + name, "type": kind, **keys})
    return layers


# ------------------------------------------------------------------------------------------------- how it is watched
class Projection:
    """The newest picture of projector_node, BGR."""

    def __init__(self):
        import rospy
        from sensor_msgs.msg import Image
        self.message = None
        self.subscriber = rospy.Subscriber("/projector/image", Image, self.keep, queue_size=1, buff_size=1 << 24)

    def keep(self, message):
        self.message = message

    def picture(self):
        import numpy
        if self.message is None:
            return numpy.zeros((HEIGHT, WIDTH, 3), numpy.uint8)
        flat = numpy.frombuffer(self.message.data, numpy.uint8)
        return flat.reshape(HEIGHT, WIDTH, 3)[:, :, ::-1].copy()


def settled(look, is_lit, seconds=8):
    """The first picture that is lit (or dark) and equals the one before; None if there is none in time."""
    import numpy
    end, last = time.monotonic() + seconds, None
    while time.monotonic() < end:
        picture = look()
        if (picture.max() > LIT) == is_lit and last is not None and numpy.array_equal(picture, last):
            return picture
        last = picture
        time.sleep(0.15)
    return None


def overlap(name, rviz, ours):
    """Of lit pixels, intersection over union; where both are flat, pixels count as much as they are covered."""
    import numpy
    a, b = rviz.max(axis=2).astype(float), ours.max(axis=2).astype(float)
    if name.startswith(SHADED):
        # Ours is at half brightness where it is half covered; a spread is darker than that.
        a, b = a > LIT, b > (LIT if name in ("odometry", "pose_with_covariance") else 127)
    return numpy.minimum(a, b).sum() / max(1, numpy.maximum(a, b).sum())


def pair_of(name, rviz, ours, figure):
    import cv2
    import numpy
    pair = numpy.hstack([rviz, numpy.full((HEIGHT, 4, 3), 90, numpy.uint8), ours])
    for text, x in ((f"{name}  {figure:.3f}", 10), ("RViz", 10), ("Afterglow", WIDTH + 14)):
        y = 30 if text.startswith(name) else HEIGHT - 14
        cv2.putText(pair, text, (x, y), cv2.FONT_HERSHEY_SIMPLEX, 0.8, (255, 255, 255), 2, cv2.LINE_AA)
    return pair


def sheet_of(pairs):
    import cv2
    import numpy
    small = [cv2.resize(pair, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA) for pair in pairs]
    small += [numpy.zeros_like(small[0])] * (-len(small) % 3)
    small = [cv2.copyMakeBorder(p, 4, 4, 4, 4, cv2.BORDER_CONSTANT, value=(60, 60, 60)) for p in small]
    return numpy.vstack([numpy.hstack(small[i:i + 3]) for i in range(0, len(small), 3)])


def items(out):
    """(name, topic, message to show, message that erases it)"""
    from nav_msgs.msg import Path
    from visualization_msgs.msg import Marker, MarkerArray
    for name, m in markers(out).items():
        yield name, "/markers", MarkerArray([m]), MarkerArray([Marker(action=Marker.DELETEALL)])
    sheet, none = cloud(), cloud()
    none.width = none.row_step = 0
    none.data = b""
    for name in CLOUDS:
        yield name, "/" + name, sheet, none
    line, nothing = path(), Path()
    nothing.header.frame_id = "map"
    for name in PATHS:
        yield name, "/" + name, line, nothing
    for name, (*_, shown, eraser) in others().items():
        yield name, "/" + name, shown, eraser


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("--bin", default=os.path.join(os.path.dirname(__file__), "../../build/bin"))
    parser.add_argument("--only", default="", help="items whose name begins with this")
    options = parser.parse_args()
    stage.require(options.bin)
    import cv2
    import numpy
    import rospy
    out = os.path.abspath(options.out)
    with stage.Stage(out, WIDTH, HEIGHT) as set_up:
        rospy.init_node("compare", disable_signals=True)
        eye = stage.broadcast_eye(EYE, PITCH)
        wanted = [item for item in items(out) if item[0].startswith(options.only)]
        publishers = {topic: rospy.Publisher(topic, type(message), queue_size=5) for _, topic, message, _ in wanted}
        set_up.start_rviz(rviz_displays(), EYE, PITCH)
        node = set_up.start_projector(options.bin, our_layers(), mesh_roots=[out])
        projection = Projection()
        stage.wait_until(lambda: node.poll() is not None or projection.message is not None, "projector_node")
        if node.poll() is not None:
            sys.exit(open(os.path.join(out, "projector.log")).read())
        stage.wait_until(lambda: all(p.get_num_connections() == 2 for p in publishers.values()), "both to listen")
        pairs, unseen = [], []
        for name, topic, message, eraser in wanted:
            publishers[topic].publish(message)
            rviz, ours = settled(set_up.screenshot, True), settled(projection.picture, True)
            publishers[topic].publish(eraser)
            settled(set_up.screenshot, False)
            settled(projection.picture, False)
            for who, picture in (("RViz", rviz), ("projector_node", ours)):
                if picture is None:
                    print(f"{name:20} not drawn by {who}")
                    unseen.append(name)
            rviz, ours = (numpy.zeros((HEIGHT, WIDTH, 3), numpy.uint8) if p is None else p for p in (rviz, ours))
            figure = overlap(name, rviz, ours)
            print(f"{name:20} {figure:.3f}", flush=True)
            pairs.append(pair_of(name, rviz, ours, figure))
            cv2.imwrite(os.path.join(out, name + ".png"), pairs[-1])
        cv2.imwrite(os.path.join(out, "sheet.png"), sheet_of(pairs))
        del eye
    return 1 if unseen else 0


if __name__ == "__main__":
    sys.exit(main())
