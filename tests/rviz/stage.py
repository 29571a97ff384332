"""RViz and projector_node side by side: one master, one X server without a screen, one projector that looks at the
world exactly as RViz does (the same place, the same field of view, no lens distortion).

Both are driven by the comparisons of this folder, by hand; nothing here runs in ctest.
"""
import importlib.util
import math
import os
import shutil
import signal
import socket
import subprocess
import sys
import time

PROGRAMS = {"rviz": "rviz", "Xvfb": "xvfb", "import": "imagemagick", "rosmaster": "python3-rosmaster"}
MODULES = {"rospy": "python3-rospy", "cv2": "python3-opencv", "numpy": "python3-numpy", "yaml": "python3-yaml",
           "tf2_msgs": "python3-tf2-msgs", "visualization_msgs": "python3-visualization-msgs",
           "sensor_msgs": "python3-sensor-msgs", "nav_msgs": "python3-nav-msgs",
           "geometry_msgs": "python3-geometry-msgs",
           "diagnostic_msgs": "python3-diagnostic-msgs"}
FIELD_OF_VIEW = math.pi / 4  # vertical; RViz's


def require(folder, modules=()):
    """Exits with what to install, or to build, where something is missing."""
    wanted = dict(MODULES, **dict(modules))
    missing = [package for name, package in PROGRAMS.items() if not shutil.which(name)]
    missing += [package for name, package in wanted.items() if importlib.util.find_spec(name) is None]
    if missing:
        sys.exit("missing: apt-get install --no-install-recommends " + " ".join(missing) +
                 " (and run this with /usr/bin/python3)")
    if not os.access(os.path.join(folder, "projector_node"), os.X_OK):
        sys.exit(f"no projector_node in {folder}: build first, or name its folder with --bin")


def free_port():
    with socket.socket() as listener:
        listener.bind(("localhost", 0))
        return listener.getsockname()[1]


class Stage:
    """The programs of one comparison; leaving the `with` block ends them, the last started first."""

    def __init__(self, out, width, height):
        self.out, self.width, self.height = out, width, height
        self.running = []
        os.makedirs(out, exist_ok=True)

    def __enter__(self):
        signal.signal(signal.SIGTERM, signal.default_int_handler)  # leaves the block, too
        port = free_port()
        os.environ["ROS_MASTER_URI"] = f"http://localhost:{port}"
        os.environ["ROS_LOG_DIR"] = os.path.join(self.out, "log")
        self.start("master", ["rosmaster", "--core", "-p", str(port)])
        display = next(f":{n}" for n in range(70, 1000) if not os.path.exists(f"/tmp/.X{n}-lock"))
        os.environ["DISPLAY"] = display
        self.start("xvfb", ["Xvfb", display, "-screen", "0", f"{self.width}x{self.height}x24", "+extension", "GLX",
                            "-nolisten", "tcp"])
        wait_until(lambda: os.path.exists(f"/tmp/.X11-unix/X{display[1:]}"), "Xvfb")
        wait_until(lambda: answers(port), "rosmaster")
        return self

    def __exit__(self, *unused):
        for process in reversed(self.running):
            self.end(process)

    def start(self, name, arguments, **environment):
        log = open(os.path.join(self.out, name + ".log"), "w")
        process = subprocess.Popen(arguments, stdout=log, stderr=log, env=dict(os.environ, **environment))
        self.running.append(process)
        return process

    def end(self, process):
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(5)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        if process in self.running:
            self.running.remove(process)

    def start_rviz(self, displays, eye, pitch, frame_rate=30):
        """Full screen on the X server. `eye` in map, looking along +x, `pitch` rad downwards."""
        path = os.path.join(self.out, "compare.rviz")
        write_yaml(path, {
            "Panels": [],
            "Visualization Manager": {
                "Class": "", "Enabled": True, "Name": "root", "Value": True, "Displays": displays,
                "Global Options": {"Background Color": "0; 0; 0", "Default Light": True, "Fixed Frame": "map",
                                   "Frame Rate": frame_rate},
                "Tools": [{"Class": "rviz/MoveCamera"}],
                "Views": {"Current": {"Class": "rviz/FPS", "Name": "Current View", "Near Clip Distance": 0.01,
                                      "Pitch": pitch, "Yaw": 0.0, "Target Frame": "map",
                                      "Position": dict(zip("XYZ", map(float, eye)))}}},
            "Window Geometry": {"X": 0, "Y": 0, "Width": self.width, "Height": self.height, "Hide Left Dock": True,
                                "Hide Right Dock": True}})
        return self.start("rviz", ["rviz", "-d", path, "--fullscreen", "--splash-screen", ""],
                          LIBGL_ALWAYS_SOFTWARE="1")

    def start_projector(self, folder, layers, rate=30, **more):
        """projector_node; its frame is `projector`, which broadcast_eye() places."""
        focal = self.height / 2 / math.tan(FIELD_OF_VIEW / 2)
        k = [focal, 0.0, self.width / 2 - 0.5, 0.0, focal, self.height / 2 - 0.5, 0.0, 0.0, 1.0]
        write_yaml(os.path.join(self.out, "lens.yaml"), {
            "image_width": self.width, "image_height": self.height, "camera_name": "projector",
            "distortion_model": "plumb_bob",
            "camera_matrix": {"rows": 3, "cols": 3, "data": k},
            "distortion_coefficients": {"rows": 1, "cols": 5, "data": [0.0] * 5}})
        path = os.path.join(self.out, "projector.yaml")
        write_yaml(path, {"fixed_frame": "map", "projector": {"camera_info": "lens.yaml", "frame": "projector"},
                          "layers": layers, **more})
        return self.start("projector", [os.path.join(folder, "projector_node"), "__name:=projector",
                                        f"_config:={path}", f"_rate:={rate}", "_window:=false"])

    def screenshot(self):
        """What is on the X server's screen, BGR."""
        import cv2
        import numpy
        png = subprocess.run(["import", "-window", "root", "png:-"], check=True, stdout=subprocess.PIPE).stdout
        return cv2.imdecode(numpy.frombuffer(png, numpy.uint8), cv2.IMREAD_COLOR)


def write_yaml(path, content):
    import yaml
    with open(path, "w") as file:
        yaml.safe_dump(content, file)


def answers(port):
    with socket.socket() as client:
        return client.connect_ex(("localhost", port)) == 0


def wait_until(is_so, what, seconds=30):
    end = time.monotonic() + seconds
    while not is_so():
        if time.monotonic() > end:
            sys.exit(f"waited {seconds} s for {what}")
        time.sleep(0.1)


def broadcast_eye(eye, pitch):
    """Puts the projector where RViz's eye is. Returns the latched publisher, to be kept."""
    import rospy
    from geometry_msgs.msg import TransformStamped
    from tf2_msgs.msg import TFMessage
    transform = TransformStamped()
    transform.header.frame_id, transform.child_frame_id = "map", "projector"
    position, turn = transform.transform.translation, transform.transform.rotation
    position.x, position.y, position.z = eye
    # x right, y down, z forward, tilted down by the pitch: a turn about map's y after the optical one.
    optical, tilt = (-0.5, 0.5, -0.5, 0.5), (0.0, math.sin(pitch / 2), 0.0, math.cos(pitch / 2))
    turn.x, turn.y, turn.z, turn.w = product(tilt, optical)
    publisher = rospy.Publisher("/tf_static", TFMessage, queue_size=1, latch=True)
    publisher.publish([transform])
    return publisher


def product(a, b):
    """Of quaternions (x, y, z, w)."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz)
