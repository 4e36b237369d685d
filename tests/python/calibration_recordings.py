"""Synthetic recordings for a calibration, as a tracker and a force sensor give them, with a known truth; rosbags writes them."""

import numpy
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

store = get_typestore(Stores.ROS2_HUMBLE)
TYPES = store.types

# centre of the ball from the tracked point
OFFSET_MM = numpy.array([2.1, -1.3, -141.8])
# pose of the scan in space
SPACE_TURN, SPACE_MM = Rotation.from_rotvec([0.5, -1.2, 2.0]), numpy.array([410.0, -220.0, 130.0])
WEIGHT_N, CENTRE_MM = numpy.array([0.3, -0.2, -2.7]), numpy.array([4.0, -11.0, 52.0])
BIAS_N, BIAS_NM = numpy.array([-2.0, 3.5, 1.0]), numpy.array([0.12, -0.3, 0.05])
# standard deviations of one reading along each axis
NOISE_MM, NOISE_N, NOISE_NM = 0.02, 0.02, 0.001
RADIUS_MM = 1.5
# points on the scan and the normals there
POINTS_MM = numpy.array([[0, 10, 0], [20, 0, 10], [30, 20, 20], [10, 10, 30], [15, 30, 5]], float)
NORMALS = numpy.array([[-1, 0, 0], [0, -1, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]], float)


def swing():
    """The ball rests while the stylus swings for half a minute: place, turn, force and torque at each hundredth of a second."""
    rng = numpy.random.default_rng(1)
    for i in range(3000):
        t = i / 100
        turn = Rotation.from_rotvec([0.5 * numpy.sin(t), 0.4 * numpy.cos(1.7 * t), 0.2])
        place = numpy.array([300.0, 200, 50]) - turn.apply(OFFSET_MM) + rng.normal(0, NOISE_MM, 3)
        yield i * 10_000_000, place, turn, *loaded(turn, rng)


def still():
    """In free air, still for a second and a half in each of twelve places and orientations."""
    rng = numpy.random.default_rng(2)
    for i in range(12 * 150):
        k = i // 150
        turn = Rotation.from_rotvec(1.5 * numpy.array([numpy.sin(1.3 * k), numpy.cos(2.1 * k), numpy.sin(0.7 * k)]))
        place = numpy.array([400.0, 100, 300]) + 40 * numpy.array([numpy.sin(k), numpy.cos(2 * k), numpy.sin(3 * k)])
        yield i * 10_000_000, place, turn, *loaded(turn, rng)


def dwells():
    """The ball rests on each of the points for 0.8 s, pressing with 2 N; the sensor carries nothing."""
    rng = numpy.random.default_rng(3)
    for k, (point, normal) in enumerate(zip(POINTS_MM, NORMALS, strict=True)):
        for tick in range(650):
            presses = 125 <= tick < 525
            away = 0.16 * max(125 - tick, tick - 525, 0)
            turn = Rotation.from_rotvec([0.1 * k, 0.2, -0.3])
            place = point + normal * (RADIUS_MM + away) - turn.apply(OFFSET_MM) + rng.normal(0, NOISE_MM, 3)
            force = turn.inv().apply(2.0 * normal if presses else numpy.zeros(3))
            yield (k * 650 + tick) * 2_000_000, SPACE_TURN.apply(place) + SPACE_MM, SPACE_TURN * turn, force, numpy.zeros(3)


def loaded(turn, rng):
    """Force and torque at the sensor from its payload."""
    weight = turn.inv().apply(WEIGHT_N)
    force = weight + BIAS_N + rng.normal(0, NOISE_N, 3)
    return force, numpy.cross(CENTRE_MM * 1e-3, weight) + BIAS_NM + rng.normal(0, NOISE_NM, 3)


def write_bag(folder, samples):
    """A folder of rosbag2 with one MCAP file in it: poses in the frame `space`, wrenches in that of the stylus."""
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        topics = {"pose": "geometry_msgs/msg/PoseStamped", "wrench": "geometry_msgs/msg/WrenchStamped"}
        topics = {name: bag.add_connection(f"/stylus/{name}", kind, typestore=store) for name, kind in topics.items()}
        for ns, place_mm, turn, force, torque in samples:
            stamp_ns = 1_000_000_000 + ns
            for name, message in [
                ("pose", TYPES["geometry_msgs/msg/PoseStamped"](header(stamp_ns, "space"), pose(place_mm, turn))),
                ("wrench", TYPES["geometry_msgs/msg/WrenchStamped"](header(stamp_ns, "stylus"), wrench(force, torque))),
            ]:
                bag.write(topics[name], stamp_ns, store.serialize_cdr(message, topics[name].msgtype))
    return folder


def write_file(path, samples):
    """The same as one file."""
    bag = write_bag(path.with_suffix(".bag"), samples)
    (file,) = bag.glob("*.mcap")
    file.rename(path)
    (bag / "metadata.yaml").unlink()
    bag.rmdir()
    return path


def write_points(path):
    rows = ["scan_x_mm,scan_y_mm,scan_z_mm", *(",".join(map(str, point)) for point in POINTS_MM)]
    path.write_text("\n".join(rows) + "\n")
    return path


def header(stamp_ns, frame):
    stamp = TYPES["builtin_interfaces/msg/Time"](sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    return TYPES["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


def pose(place_mm, turn):
    x, y, z, w = map(float, turn.as_quat())
    orientation = TYPES["geometry_msgs/msg/Quaternion"](x=x, y=y, z=z, w=w)
    place = dict(zip("xyz", map(float, place_mm * 1e-3), strict=True))
    return TYPES["geometry_msgs/msg/Pose"](position=TYPES["geometry_msgs/msg/Point"](**place), orientation=orientation)


def wrench(force, torque):
    vector = TYPES["geometry_msgs/msg/Vector3"]
    force, torque = (vector(**dict(zip("xyz", map(float, each), strict=True))) for each in (force, torque))
    return TYPES["geometry_msgs/msg/Wrench"](force=force, torque=torque)
