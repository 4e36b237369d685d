"""Debian's RViz on a display of its own, showing the topics of the node.

    target/python/bin/python tests/python/ros_rviz.py docs/rviz.png     draws the picture of the README

Debian has the RViz of ROS 1: messages go into a ROS 1 bag by rosbags and out by rosbag play, frames come from robot_state_publisher, and a
copy of config/touchup.rviz has the older names. Everything runs on loopback, on free ports.
"""

import contextlib
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import xmlrpc.client
from pathlib import Path

import numpy
import yaml
from conftest import ROOT
from rosbags.interfaces import Nodetype
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

BINARIES = {
    "Xvfb": "xvfb",
    "/usr/bin/rviz": "rviz",
    "/usr/bin/rosmaster": "python3-rosmaster",
    "/usr/lib/rosbag/play": "python3-rosbag",
    "/usr/lib/robot_state_publisher/robot_state_publisher": "ros-robot-state-publisher",
}
DEADLINE_S = 60
# of the camera, from top to bottom; Ogre's default, which RViz keeps
FIELD_OF_VIEW = numpy.pi / 4

# the plate of the demo, from near
CLOSE = {"Distance": 0.13, "Pitch": 0.85, "Yaw": 5.0, "Focal Point": {"X": 0.042, "Y": 0.025, "Z": 0.006}}

store = get_typestore(Stores.ROS1_NOETIC)


def missing_packages():
    """Debian packages without which nothing runs here."""
    return [package for binary, package in BINARIES.items() if not shutil.which(binary)]


# ---- messages


def of_ros1(message, name):
    """A message of CycloneDDS as one of ROS 1: without the fields that ROS 1 lacks, and with its names of times."""
    package, _, short = name.partition("/msg/")
    made = store.types[name]
    if short in ("Time", "Duration") and package == "builtin_interfaces":
        return made(sec=message.sec, nanosec=message.nanosec)
    values = {}
    for field, (kind, detail) in store.fielddefs[name][1]:
        if name == "std_msgs/msg/Header" and field == "seq":
            values[field] = 0
            continue
        value = getattr(message, field)
        if kind == Nodetype.NAME:
            value = of_ros1(value, detail)
        elif kind == Nodetype.SEQUENCE and detail[0][0] == Nodetype.NAME:
            value = [of_ros1(one, detail[0][1]) for one in value]
        values[field] = value
    return made(**values)


def write_bag(path, messages):
    """A ROS 1 bag of (topic, type, message), one after the other."""
    with Writer(path) as bag:
        connections = {}
        for at, (topic, name, message) in enumerate(messages):
            if topic not in connections:
                connections[topic] = bag.add_connection(topic, name, typestore=store)
            raw = store.serialize_ros1(of_ros1(message, name), name)
            bag.write(connections[topic], (1 + at) * 100_000, raw)


# ---- configuration


def older(node):
    """Contents of an RViz 2 file in the form of RViz 1."""
    if isinstance(node, list):
        return [older(value) for value in node]
    if not isinstance(node, dict):
        return node
    made = {}
    for key, value in node.items():
        if key == "Class":
            value = value.replace("rviz_default_plugins/", "rviz/").replace("rviz_common/", "rviz/")
        if key == "Description Topic":
            made["Robot Description"] = value["Value"]
        elif key == "Topic" and isinstance(value, dict):
            is_marker = node["Class"].split("/")[1] in ("Marker", "MarkerArray")
            made["Marker Topic" if is_marker else "Topic"] = value["Value"]
            made["Queue Size"] = value["Depth"]
        elif key not in ("Description Source", "Description File", "Transformation"):
            made[key] = older(value)
    return made


def config(path, size, view, hidden=()):
    """Writes config/touchup.rviz for RViz 1, with a window that fills the screen; returns its view.

    - `view`: changed settings of the view
    - `hidden`: names of displays to switch off
    """
    made = older(yaml.safe_load((ROOT / "config/touchup.rviz").read_text()))
    manager = made["Visualization Manager"]
    for display in manager["Displays"]:
        if display["Name"] in hidden:
            display["Enabled"] = display["Value"] = False
    manager["Views"]["Current"].update(view)
    # without a window manager it keeps its place
    made["Window Geometry"].update({"X": 0, "Y": 0, "Width": size[0], "Height": size[1]})
    Path(path).write_text(yaml.safe_dump(made))
    return manager["Views"]["Current"]


# ---- processes


def free_port():
    """A free port, for as long as no other process asks for one."""
    with socket.socket() as asked:
        asked.bind(("127.0.0.1", 0))
        return asked.getsockname()[1]


def wait_for(what, condition):
    """The first true answer."""
    until = time.monotonic() + DEADLINE_S
    while not (found := condition()):
        assert time.monotonic() < until, f"{what} did not come"
        time.sleep(0.05)
    return found


class Desk:
    """A display, a ROS 1 master, and RViz with a configuration; as a context.

    - `folder`: for logs, screen and configuration
    - `descriptions`: URDF by the name of its parameter
    """

    def __init__(self, folder, size, rviz_config, descriptions, *, arguments=()):
        self.folder, self.size, self.config = Path(folder), size, rviz_config
        self.descriptions, self.arguments = descriptions, arguments
        self.stack = contextlib.ExitStack()

    def start(self, name, *command, **options):
        """A process, ended with the desk."""
        log = self.stack.enter_context(open(self.folder / f"{name}.log", "wb"))
        process = subprocess.Popen(command, env=self.environment, stdout=log, stderr=log, **options)
        self.stack.callback(end, process)
        return process

    def __enter__(self):
        with contextlib.ExitStack() as self.stack:
            self.open()
            self.stack = self.stack.pop_all()
        return self

    def __exit__(self, *_):
        self.stack.close()

    def open(self):
        port = free_port()
        self.master = f"http://127.0.0.1:{port}"
        # the Python of Debian has its rospy
        self.environment = {
            **os.environ,
            "PATH": f"/usr/bin:{os.environ['PATH']}",
            "ROS_MASTER_URI": self.master,
            "ROS_IP": "127.0.0.1",
            "ROS_HOME": str(self.folder),
            "HOME": str(self.folder),
            "LIBGL_ALWAYS_SOFTWARE": "1",
            "QT_X11_NO_MITSHM": "1",
        }
        read, write = os.pipe()
        width, height = self.size
        screen = ["-screen", "0", f"{width}x{height}x24", "-nolisten", "tcp", "-nocursor", "-fbdir", str(self.folder)]
        self.start("xvfb", "Xvfb", "-displayfd", str(write), *screen, pass_fds=[write])
        os.close(write)
        with os.fdopen(read) as pipe:
            self.environment["DISPLAY"] = f":{int(pipe.readline())}"

        self.start("master", "/usr/bin/python3", "/usr/bin/rosmaster", "--core", "-p", str(port))
        self.api = xmlrpc.client.ServerProxy(self.master)
        wait_for("the master", self.answers)
        for name, urdf in self.descriptions.items():
            self.api.setParam("/test", f"/{name}", urdf)
            publisher = "/usr/lib/robot_state_publisher/robot_state_publisher"
            self.start(name, publisher, f"robot_description:={name}", f"__name:={name}_publisher")
        self.start("rviz", "/usr/bin/rviz", "-d", str(self.config), *self.arguments)

    def answers(self):
        with contextlib.suppress(OSError):
            return self.api.getPid("/test")[0] == 1

    def subscribed(self, topics):
        """Whether all of them have subscribers."""
        _, _, (_, listening, _) = self.api.getSystemState("/test")
        return set(topics) <= {topic for topic, nodes in listening if nodes}

    def play(self, messages):
        """Has RViz take up messages: (topic, type, message)."""
        wait_for("RViz", lambda: self.subscribed({topic for topic, _, _ in messages}))
        bag = self.folder / "shown.bag"
        bag.unlink(missing_ok=True)
        write_bag(bag, messages)
        play = ["/usr/lib/rosbag/play", "--wait-for-subscribers", "--queue=10000", str(bag)]
        process = self.start("play", *play, stdin=subprocess.DEVNULL)
        assert process.wait(DEADLINE_S) == 0, (self.folder / "play.log").read_text()

    def screen(self):
        """Picture of the screen: rows, columns, red green blue."""
        raw = (self.folder / "Xvfb_screen0").read_bytes()
        # the X window dump format: header, colour map of 12 bytes each, rows of blue green red nothing
        header = numpy.frombuffer(raw[:100], ">u4")
        start, width, height, row = int(header[0] + 12 * header[19]), *(int(header[at]) for at in (4, 5, 12))
        pixels = numpy.frombuffer(raw[start : start + height * row], numpy.uint8).reshape(height, row)
        return pixels[:, : 4 * width].reshape(height, width, 4)[:, :, 2::-1].copy()

    def still(self):
        """The screen once nothing on it has changed for two seconds."""
        since, before = time.monotonic(), self.screen()

        def unchanged():
            nonlocal since, before
            now = self.screen()
            if (now != before).any():
                since, before = time.monotonic(), now
            return time.monotonic() - since > 2

        wait_for("a picture that stays", unchanged)
        return before


def end(process):
    """Ends one process, and waits for it."""
    if process.poll() is None:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def described(name, scene):
    """URDF of urdf/NAME.xacro."""
    xacro = [str(Path(sys.executable).parent / "xacro"), str(ROOT / f"urdf/{name}.xacro"), f"scene:={scene}"]
    return subprocess.run(xacro, capture_output=True, text=True, check=True).stdout


# ---- camera


def camera(view):
    """Place of the view's camera, and its axes: right, down, forward."""
    yaw, pitch = view["Yaw"], view["Pitch"]
    focus = numpy.array([view["Focal Point"][axis] for axis in "XYZ"], float)
    outward = numpy.array([numpy.cos(yaw) * numpy.cos(pitch), numpy.sin(yaw) * numpy.cos(pitch), numpy.sin(pitch)])
    right = numpy.cross([0.0, 0.0, 1.0], outward)
    right /= numpy.linalg.norm(right)
    return focus + view["Distance"] * outward, numpy.array([right, numpy.cross(right, -outward) * -1, -outward])


def rays(view, size):
    """A ray through the middle of each pixel: rows, columns, (start, direction)."""
    width, height = size
    place, axes = camera(view)
    y, x = numpy.mgrid[0:height, 0:width] + 0.5
    scale = numpy.tan(FIELD_OF_VIEW / 2) / (height / 2)
    directions = numpy.stack([(x - width / 2) * scale, (y - height / 2) * scale, numpy.ones_like(x)], -1) @ axes
    return numpy.concatenate([numpy.broadcast_to(place, directions.shape), directions], -1)


def projected(view, size, points):
    """Pixels (column, row) of points."""
    width, height = size
    place, axes = camera(view)
    seen = (numpy.asarray(points) - place) @ axes.T
    scale = (height / 2) / numpy.tan(FIELD_OF_VIEW / 2)
    return seen[:, :2] / seen[:, 2:] * scale + [width / 2, height / 2]


# ---- the picture of the README


def main(out):
    """Plays the recording of the demo to a node, and takes RViz's picture of the node's topics."""
    import open3d
    from ros_domains import domains
    from ros_shown import show

    touchup = ROOT / "target/release/touchup"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        subprocess.run([touchup, "demo", "--out", folder], check=True, stdout=subprocess.DEVNULL)
        shown = show(touchup, folder, folder, next(domains), 4)
        path, size = folder / "shown.rviz", (1280, 800)
        config(path, size, CLOSE)
        description = {"cell_description": described("cell", ROOT / "config/default.yaml")}
        with Desk(folder, size, path, description) as desk:
            desk.play(
                [("/mesh", "visualization_msgs/msg/Marker", tile) for tile in shown.tiles]
                + [("/feature_markers", "visualization_msgs/msg/MarkerArray", shown.features)]
                + [("/tip", "visualization_msgs/msg/MarkerArray", shown.tip)]
            )
            # the clock in the window never stands still
            time.sleep(3)
            open3d.io.write_image(str(out), open3d.geometry.Image(desk.screen()))


if __name__ == "__main__":
    main(*sys.argv[1:])
