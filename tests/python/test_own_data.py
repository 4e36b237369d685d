"""Recordings of independent writers read as written: `touchup convert` makes MCAP of them.

The values of the messages are random; rosbags reads touchup's output again, and the test compares it with its own input.
"""

import csv
import itertools
import json

import franka_state
import numpy as np
import pandas
import pytest
from pyarrow import parquet
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin, Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from scipy.spatial.transform import Rotation, Slerp
from test_recordings import POSE, WRENCH, numbers

START_NS = 1_700_000_000_000_000_000
PERIOD_NS = 2_000_000


def values(count, seed=1):
    """Stamps, positions in m, rotations and wrenches in N and N·m."""
    random = np.random.default_rng(seed)
    stamps = START_NS + PERIOD_NS * np.arange(count)
    return stamps, random.normal(size=(count, 3)), Rotation.random(count, rng=random), random.normal(size=(count, 6))


def converted(touchup, tmp_path, source, *flags):
    """Poses and wrenches in the output of `touchup convert`, and its printed text."""
    out = tmp_path / "converted.mcap"
    done = touchup("convert", source, "--out", out, "--json", *flags)
    assert done.returncode == 0, done.stderr
    found = {POSE: [], WRENCH: []}
    with AnyReader([out], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        for connection, _, payload in reader.messages():
            found[connection.topic].append(numbers(reader.deserialize(payload, connection.msgtype)))
    return found[POSE], found[WRENCH], json.loads(done.stdout)


def assert_same(found, stamps, expected, frame, tolerance=0):
    assert [stamp for stamp, _, _ in found] == list(stamps)
    assert {name for _, name, _ in found} == {frame}
    assert np.abs(np.array([numbers for _, _, numbers in found]) - expected).max() <= tolerance


class Messages:
    """Messages of ROS 1 or 2 by their types."""

    def __init__(self, store):
        self.store = get_typestore(store)
        self.is_ros1 = store == Stores.ROS1_NOETIC
        if self.is_ros1:
            text = "geometry_msgs/TransformStamped[] transforms"
            self.store.register(get_types_from_msg(text, "tf2_msgs/msg/TFMessage"))
        self.count = 0

    def of(self, name, **fields):
        return self.store.types[name](**fields)

    def header(self, stamp_ns, frame):
        stamp = self.of("builtin_interfaces/msg/Time", sec=int(stamp_ns // 10**9), nanosec=int(stamp_ns % 10**9))
        self.count += 1
        seq = {"seq": self.count} if self.is_ros1 else {}
        return self.of("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **seq)

    def vector(self, name, xyz):
        return self.of(f"geometry_msgs/msg/{name}", **dict(zip("xyz", map(float, xyz))))

    def turn(self, rotation):
        return self.of("geometry_msgs/msg/Quaternion", **dict(zip("xyzw", map(float, rotation.as_quat()))))

    def pose(self, position, rotation):
        return self.of("geometry_msgs/msg/Pose", position=self.vector("Point", position), orientation=self.turn(rotation))

    def wrench(self, six):
        return self.of("geometry_msgs/msg/Wrench", force=self.vector("Vector3", six[:3]), torque=self.vector("Vector3", six[3:]))

    def transform(self, stamp_ns, parent, child, position, rotation):
        transform = self.of(
            "geometry_msgs/msg/Transform", translation=self.vector("Vector3", position), rotation=self.turn(rotation)
        )
        header = self.header(stamp_ns, parent)
        return self.of("geometry_msgs/msg/TransformStamped", header=header, child_frame_id=child, transform=transform)

    def posed(self, name, stamp_ns, frame, position, rotation):
        """A message of any type that holds a pose, at that stamp."""
        pose, covariance = self.pose(position, rotation), np.arange(36.0)
        with_covariance = self.of("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=covariance)
        header = self.header(stamp_ns, frame)
        match name:
            case "geometry_msgs/msg/Pose":
                return pose
            case "geometry_msgs/msg/PoseStamped":
                return self.of(name, header=header, pose=pose)
            case "geometry_msgs/msg/PoseWithCovarianceStamped":
                return self.of(name, header=header, pose=with_covariance)
            case "geometry_msgs/msg/TransformStamped":
                return self.transform(stamp_ns, frame, "tool0", position, rotation)
            case "nav_msgs/msg/Odometry":
                twist = self.of("geometry_msgs/msg/Twist", linear=self.vector("Vector3", [7, 8, 9]), angular=self.vector("Vector3", [7, 8, 9]))
                twist = self.of("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=covariance)
                return self.of(name, header=header, child_frame_id="tool0", pose=with_covariance, twist=twist)


def write(folder, kind, messages, topics):
    """Topics are name, type and (stamp, message) each: a recording of the kind, in order of time."""
    if kind.startswith("bag"):
        path = folder / "touch.bag"
        writer = Writer1(path)
        if kind != "bag":
            writer.set_compression({"bag-bz2": Writer1.CompressionFormat.BZ2, "bag-lz4": Writer1.CompressionFormat.LZ4}[kind])
        serialize = messages.store.serialize_ros1
    else:
        path = folder / "touch"
        plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        writer = Writer2(path, version=9, storage_plugin=plugin)
        serialize = messages.store.serialize_cdr
    with writer:
        rows = []
        for topic, name, stamped in topics:
            connection = writer.add_connection(topic, name, typestore=messages.store)
            rows += [(int(stamp), connection, serialize(message, name)) for stamp, message in stamped]
        for stamp, connection, payload in sorted(rows, key=lambda row: row[0]):
            writer.write(connection, stamp, bytes(payload))
    return path


def store_of(kind):
    return Stores.ROS1_NOETIC if kind.startswith("bag") else Stores.ROS2_HUMBLE


KINDS = ["mcap", "db3", "bag", "bag-bz2", "bag-lz4"]
POSES = [
    "geometry_msgs/msg/Pose",
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/TransformStamped",
    "nav_msgs/msg/Odometry",
]


@pytest.mark.parametrize("kind", KINDS)
def test_each_type_of_pose_is_read_from_each_kind_of_recording(touchup, tmp_path, kind):
    messages = Messages(store_of(kind))
    stamps, positions, rotations, wrenches = values(50)
    topics = [
        (f"/pose_{at}", name, [(t, messages.posed(name, t, "base", p, r)) for t, p, r in zip(stamps, positions, rotations)])
        for at, name in enumerate(POSES)
    ]
    stamped = [messages.of("geometry_msgs/msg/WrenchStamped", header=messages.header(t, "tool0"), wrench=messages.wrench(w)) for t, w in zip(stamps, wrenches)]
    topics.append(("/wrench", "geometry_msgs/msg/WrenchStamped", list(zip(stamps, stamped))))
    topics.append(("/bare", "geometry_msgs/msg/Wrench", [(t, messages.wrench(w)) for t, w in zip(stamps, wrenches)]))
    path = write(tmp_path, kind, messages, topics)
    for at, name in enumerate(POSES):
        wrench, frame = ("/bare", "unnamed") if at == 0 else ("/wrench", "tool0")
        poses, forces, told = converted(touchup, tmp_path, path, "--pose-topic", f"/pose_{at}", "--wrench-topic", wrench)
        assert_same(poses, stamps, np.hstack([positions, rotations.as_quat()]), "unnamed" if at == 0 else "base", 1e-15)
        assert_same(forces, stamps, wrenches, frame)
        assert (told["poses"], told["wrenches"]) == (50, 50)


@pytest.mark.parametrize("kind", ["mcap", "db3", "bag"])
def test_a_pose_is_taken_from_a_tree_of_transforms(touchup, tmp_path, kind):
    """The chain base → shoulder → wrist → tool0 as products of rotations by SciPy; other frames move beside it."""
    messages = Messages(store_of(kind))
    stamps, positions, rotations, wrenches = values(60)
    _, others, turns, _ = values(60, seed=2)
    mount, mount_turn = np.array([0.0, 0.0, 0.1]), Rotation.from_rotvec([0.1, 0.2, 0.3])
    name = "tf2_msgs/msg/TFMessage"
    moving = [
        messages.of(
            name,
            transforms=[
                messages.transform(t, "wrist", "camera", [9, 9, 9], r),
                messages.transform(t, "shoulder", "wrist", o, s),
                messages.transform(t, "base", "shoulder", p, r),
            ],
        )
        for t, p, r, o, s in zip(stamps, positions, rotations, others, turns)
    ]
    fixed = messages.of(
        name,
        transforms=[
            messages.transform(0, "wrist", "tool0", mount, mount_turn),
            messages.transform(0, "world", "base", [5, 6, 7], Rotation.identity()),
        ],
    )
    stamped = [messages.of("geometry_msgs/msg/WrenchStamped", header=messages.header(t, "tool0"), wrench=messages.wrench(w)) for t, w in zip(stamps, wrenches)]
    # the static transforms come late, as from a recorder that began before its publisher
    topics = [
        ("/tf", name, list(zip(stamps, moving))),
        ("/tf_static", name, [(stamps[3], fixed)]),
        ("/wrench", "geometry_msgs/msg/WrenchStamped", list(zip(stamps, stamped))),
    ]
    path = write(tmp_path, kind, messages, topics)
    expected = positions + rotations.apply(others + turns.apply(np.tile(mount, (60, 1))))
    expected_turns = (rotations * turns * mount_turn).as_quat()
    for base, shift in [("base", 0), ("world", np.array([5.0, 6.0, 7.0])), (None, np.array([5.0, 6.0, 7.0]))]:
        flags = ["--base-frame", base] if base else []
        poses, _, told = converted(touchup, tmp_path, path, "--pose-frame", "tool0", "--wrench-topic", "/wrench", *flags)
        assert told["pose_frame"] == (base or "world")
        found = np.array([numbers for _, _, numbers in poses])
        assert [stamp for stamp, _, _ in poses] == list(stamps)
        assert np.abs(found[:, :3] - expected - shift).max() < 1e-12
        assert (np.abs(np.abs((found[:, 3:] * expected_turns).sum(axis=1)) - 1) < 1e-12).all()
    for flags, words in [
        (["--pose-frame", "tool1"], ["--pose-frame", "tool0 (in wrist)"]),
        (["--pose-frame", "tool0", "--base-frame", "floor"], ["--base-frame", "world"]),
        (["--pose-topic", "/tf"], ["--pose-frame", "many frames"]),
    ]:
        done = touchup("convert", path, "--out", tmp_path / "none.mcap", "--wrench-topic", "/wrench", *flags)
        assert done.returncode == 3 and all(word in done.stderr for word in words), done.stderr


def test_links_of_unlike_rates_are_interpolated_and_counted(touchup, tmp_path):
    """SciPy's slerp and NumPy's interp of the slow link, at the stamps of the fast one; over a gap, and beyond its ends, there is nothing."""
    messages = Messages(Stores.ROS2_HUMBLE)
    stamps, positions, rotations, wrenches = values(500)
    rotations = Rotation.from_rotvec(np.cumsum(0.01 * rotations.as_rotvec(), axis=0))
    slow_at = np.arange(3, 480, 10)
    # 2 ms apart: from 203 to 293 are 0.18 s
    slow_at = slow_at[(slow_at <= 203) | (slow_at >= 293)]
    name = "tf2_msgs/msg/TFMessage"
    _, slow, turns, _ = values(len(slow_at), seed=3)
    fast = [(t, messages.of(name, transforms=[messages.transform(t, "arm", "tool0", p, r)])) for t, p, r in zip(stamps, positions, rotations)]
    # half a period beside the stamps of the others, except every second one
    slow_stamps = stamps[slow_at] + np.where(np.arange(len(slow_at)) % 2, PERIOD_NS // 2, 0)
    base = [(t, messages.of(name, transforms=[messages.transform(t, "base", "arm", p, r)])) for t, p, r in zip(slow_stamps, slow, turns)]
    stamped = [messages.of("geometry_msgs/msg/WrenchStamped", header=messages.header(t, "tool0"), wrench=messages.wrench(w)) for t, w in zip(stamps, wrenches)]
    topics = [("/tf", name, fast + base), ("/wrench", "geometry_msgs/msg/WrenchStamped", list(zip(stamps, stamped)))]
    path = write(tmp_path, "mcap", messages, topics)
    out = tmp_path / "converted.mcap"
    done = touchup("convert", path, "--out", out, "--json", "--pose-frame", "tool0", "--base-frame", "base", "--wrench-topic", "/wrench")
    found = []
    with AnyReader([out], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        for connection, _, payload in reader.messages():
            if connection.topic == POSE:
                found.append(numbers(reader.deserialize(payload, connection.msgtype)))
    every = np.union1d(stamps, slow_stamps)
    within = every[(every >= slow_stamps[0]) & (every <= slow_stamps[-1])]
    gap = (within > slow_stamps[slow_at <= 203][-1]) & (within < slow_stamps[slow_at >= 293][0])
    expected = within[~gap]
    assert [stamp for stamp, _, _ in found] == list(expected)
    of = lambda at, known, poses: np.stack([np.interp(at - START_NS, known - START_NS, poses[:, axis]) for axis in range(3)], axis=1)
    turn = lambda at, known, of: Slerp(known - START_NS, of)(at - START_NS)
    arm, arm_turn = of(expected, slow_stamps, slow), turn(expected, slow_stamps, turns)
    tool, tool_turn = of(expected, stamps, positions), turn(expected, stamps, rotations)
    got = np.array([values for _, _, values in found])
    assert np.abs(got[:, :3] - arm - arm_turn.apply(tool)).max() < 1e-9
    assert (np.abs(np.abs((got[:, 3:] * (arm_turn * tool_turn).as_quat()).sum(axis=1)) - 1) < 1e-9).all()
    both = np.isin(expected, stamps) & np.isin(expected, slow_stamps)
    told = json.loads(done.stdout)["transforms"]
    assert told == {"interpolated": int((~both).sum()), "outside": len(every) - len(within)}
    assert done.returncode == 4 and f"{gap.sum()} messages transforms_apart" in done.stderr, done.stderr


def test_a_table_of_pandas_is_read_with_the_units_of_its_header(touchup, tmp_path):
    stamps, positions, rotations, wrenches = values(80)
    table = pandas.DataFrame(positions * 1e3, columns=["x_mm", "y_mm", "z_mm"])
    table[["qx", "qy", "qz", "qw"]] = rotations.as_quat()
    table[["Fx [N]", "Fy [N]", "Fz [N]"]] = wrenches[:, :3]
    table[["tx_Nmm", "ty_Nmm", "tz_Nmm"]] = wrenches[:, 3:] * 1e3
    table.insert(0, "time_ns", stamps)
    # a sensor that is slower than the other leaves its places empty
    table.loc[table.index % 2 == 1, ["Fx [N]", "Fy [N]", "Fz [N]"]] = np.nan
    for separator, name in [(",", "touch.csv"), ("\t", "touch.tsv"), (";", "touch.txt")]:
        table.to_csv(tmp_path / name, sep=separator, index=False)
        poses, forces, told = converted(touchup, tmp_path, tmp_path / name)
        assert_same(poses, stamps, np.hstack([positions, rotations.as_quat()]), "object", 1e-15)
        assert_same(forces, stamps[::2], wrenches[::2], "object", 1e-15)
        assert (told["poses"], told["wrenches"]) == (80, 40)


def test_the_scene_names_columns_and_the_axes_of_the_wrench(touchup, tmp_path):
    stamps, positions, rotations, wrenches = values(30)
    table = pandas.DataFrame(np.hstack([positions, rotations.as_rotvec(degrees=True), wrenches[:, :3]]), columns=list("abcdefuvw"))
    table.insert(0, "zeit", (stamps - START_NS) / 1e6)
    table.to_csv(tmp_path / "touch.csv", index=False)
    scene = tmp_path / "scene.yaml"
    scene.write_text(
        "columns:\n  time: zeit [ms]\n  position: [a_m, b_m, c_m]\n  orientation: [d_deg, e_deg, f_deg]\n"
        "  force: [u_N, v_N, w_N]\n  wrench_axes: tip\n"
    )
    poses, forces, _ = converted(touchup, tmp_path, tmp_path / "touch.csv", "--scene", scene)
    assert_same(forces, stamps - START_NS, np.hstack([wrenches[:, :3], np.zeros((30, 3))]), "stylus")
    found = np.array([numbers for _, _, numbers in poses])
    assert np.abs(found[:, :3] - positions).max() == 0
    assert (np.abs(np.abs((found[:, 3:] * rotations.as_quat()).sum(axis=1)) - 1) < 1e-12).all()
    done = touchup("convert", tmp_path / "touch.csv", "--out", tmp_path / "none.mcap")
    assert done.returncode == 3 and "It has: zeit, a, b" in done.stderr and "columns:" in done.stderr, done.stderr


@pytest.mark.parametrize("separator", [",", " "])
def test_a_log_of_rtde_is_read_without_a_word(touchup, tmp_path, separator):
    """ur_rtde separates by commas, the client of Universal Robots by blanks; both number the axes."""
    stamps, positions, rotations, wrenches = values(40)
    names = ["actual_q", "actual_TCP_pose", "actual_TCP_force"]
    columns = ["timestamp"] + [f"{name}_{axis}" for name in names for axis in range(6)]
    seconds = (stamps - START_NS)[:, None] / 1e9
    rows = np.hstack([seconds, np.full((40, 6), 7.0), positions, rotations.as_rotvec(), wrenches])
    pandas.DataFrame(rows, columns=columns).to_csv(tmp_path / "robot_data.csv", sep=separator, index=False)
    poses, forces, _ = converted(touchup, tmp_path, tmp_path / "robot_data.csv")
    assert_same(forces, stamps - START_NS, wrenches, "object")
    found = np.array([numbers for _, _, numbers in poses])
    assert np.abs(found[:, :3] - positions).max() == 0
    assert (np.abs(np.abs((found[:, 3:] * rotations.as_quat()).sum(axis=1)) - 1) < 1e-12).all()


def test_a_bag_that_is_cut_anywhere_is_read_up_to_there_or_refused_in_words(touchup, tmp_path):
    messages = Messages(Stores.ROS1_NOETIC)
    stamps, positions, rotations, wrenches = values(200)
    name = "geometry_msgs/msg/PoseStamped"
    poses = [(t, messages.posed(name, t, "base", p, r)) for t, p, r in zip(stamps, positions, rotations)]
    stamped = [(t, messages.of("geometry_msgs/msg/WrenchStamped", header=messages.header(t, "base"), wrench=messages.wrench(w))) for t, w in zip(stamps, wrenches)]
    whole = write(tmp_path, "bag", messages, [("/stylus/pose", name, poses), ("/stylus/wrench", "geometry_msgs/msg/WrenchStamped", stamped)])
    content = whole.read_bytes()
    cut = tmp_path / "cut.bag"
    for length in [5, 13, 40, 4100, 5000, len(content) // 2, len(content) - 1]:
        cut.write_bytes(content[:length])
        done = touchup("convert", cut, "--out", tmp_path / "part.mcap")
        assert done.returncode in (3, 4) and done.stderr.startswith("touchup: ") and done.stderr.count("\n") == 1, done.stderr


def test_the_state_of_a_franka_holds_pose_and_wrench(touchup, tmp_path):
    """By the definition of franka_msgs 0.10 for ROS 1, with random numbers beside the pose."""
    sizes = {
        "cartesian_collision": 6, "cartesian_contact": 6, "q": 7, "q_d": 7, "dq": 7, "dq_d": 7, "theta": 7, "dtheta": 7,
        "tau_J": 7, "dtau_J": 7, "tau_J_d": 7, "K_F_ext_hat_K": 6, "elbow": 2, "elbow_d": 2, "joint_collision": 7,
        "joint_contact": 7, "O_F_ext_hat_K": 6, "tau_ext_hat_filtered": 7, "m_ee": 0, "F_x_Cee": 3, "I_ee": 9, "m_load": 0,
        "F_x_Cload": 3, "I_load": 9, "m_total": 0, "F_x_Ctotal": 3, "I_total": 9, "O_T_EE": 16, "O_T_EE_d": 16, "F_T_EE": 16,
        "EE_T_K": 16, "time": 0, "control_command_success_rate": 0,
    }  # fmt: skip
    fields = [f"float64{f'[{size}]' if size else ''} {name}" for name, size in sizes.items()]
    errors = "\n".join(f"bool error_{at}" for at in range(37))
    text = "std_msgs/Header header\n" + "\n".join(fields) + "\nuint8 robot_mode\nfranka_msgs/Errors current_errors\nfranka_msgs/Errors last_motion_errors\n"
    messages = Messages(Stores.ROS1_NOETIC)
    messages.store.register(get_types_from_msg(errors, "franka_msgs/msg/Errors"))
    messages.store.register(get_types_from_msg(text, "franka_msgs/msg/FrankaState"))
    stamps, positions, rotations, wrenches = values(30)
    random = np.random.default_rng(5)
    none = messages.of("franka_msgs/msg/Errors", **{f"error_{at}": False for at in range(37)})

    def state(stamp, position, rotation, wrench):
        numbers = {name: random.normal(size=size) if size else float(random.normal()) for name, size in sizes.items()}
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = rotation.as_matrix(), position
        numbers["O_T_EE"], numbers["O_F_ext_hat_K"] = matrix.T.flatten(), wrench
        return messages.of(
            "franka_msgs/msg/FrankaState", header=messages.header(stamp, "panda_link0"), robot_mode=2, current_errors=none, last_motion_errors=none, **numbers
        )

    topic = "/franka_state_controller/franka_states"
    path = write(tmp_path, "bag", messages, [(topic, "franka_msgs/msg/FrankaState", [(row[0], state(*row)) for row in zip(stamps, positions, rotations, wrenches)])])
    poses, forces, _ = converted(touchup, tmp_path, path, "--pose-topic", topic, "--wrench-topic", topic)
    assert_same(forces, stamps, wrenches, "panda_link0")
    found = np.array([numbers for _, _, numbers in poses])
    assert np.abs(found[:, :3] - positions).max() == 0
    assert (np.abs(np.abs((found[:, 3:] * rotations.as_quat()).sum(axis=1)) - 1) < 1e-12).all()


def test_the_state_of_franka_ros2_holds_pose_and_wrench_each_with_its_frame(touchup, tmp_path):
    """One topic gives both, or the wrench comes from a sensor of its own."""
    messages, random = Messages(Stores.ROS2_HUMBLE), np.random.default_rng(6)
    franka_state.register(messages.store)
    stamps, positions, rotations, wrenches = values(40)
    assert len(messages.store.get_msgdef(franka_state.TYPE).fields) == 27
    rows = []
    for t, p, r, w in zip(stamps, positions, rotations, wrenches):
        state = franka_state.drawn(messages.store, random)
        state.header = messages.header(t, "base")
        state.o_t_ee = messages.of("geometry_msgs/msg/PoseStamped", header=messages.header(0, ""), pose=messages.pose(p, r))
        state.o_f_ext_hat_k = messages.of("geometry_msgs/msg/WrenchStamped", header=messages.header(0, "fr3_link0"), wrench=messages.wrench(w))
        rows.append((t, state))
    other = [(t, messages.of("geometry_msgs/msg/WrenchStamped", header=messages.header(t, "ft"), wrench=messages.wrench(-w))) for t, w in zip(stamps, wrenches)]
    topic = "/franka_robot_state_broadcaster/robot_state"
    path = write(tmp_path, "mcap", messages, [(topic, franka_state.TYPE, rows), ("/ft", "geometry_msgs/msg/WrenchStamped", other)])
    for source, expected, frame in [(topic, wrenches, "fr3_link0"), ("/ft", -wrenches, "ft")]:
        poses, forces, _ = converted(touchup, tmp_path, path, "--pose-topic", topic, "--wrench-topic", source)
        assert_same(poses, stamps, np.hstack([positions, rotations.as_quat()]), "base", 1e-15)
        assert_same(forces, stamps, expected, frame)


def test_touches_and_features_are_the_same_as_csv_and_as_parquet(touchup, demo_folder, tmp_path):
    """pyarrow reads the types, pandas the text; both against Python's json and csv on the files themselves."""
    for name in ["touches.csv", "features.json"]:
        tables = []
        for ending in ["csv", "parquet"]:
            out = tmp_path / f"{name}.{ending}"
            done = touchup("convert", demo_folder / name, "--out", out, "--json")
            assert done.returncode == 0, done.stderr
            tables.append(pandas.read_csv(out) if ending == "csv" else parquet.read_table(out).to_pandas())
            assert json.loads(done.stdout)["rows"] == len(tables[-1])
        # a missing value is NaN in the one and None in the other
        same = [table.astype(object).where(table.notna(), None) for table in tables]
        pandas.testing.assert_frame_equal(*same, check_dtype=False)
    touches = parquet.read_table(tmp_path / "touches.csv.parquet")
    types = {name: str(touches.schema.field(name).type) for name in ["touch", "stamp_ns", "point_x_mm", "rejected"]}
    assert types == {"touch": "int64", "stamp_ns": "int64", "point_x_mm": "double", "rejected": "bool"}
    with (demo_folder / "touches.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == touches.num_rows > 100
    for name in ["stamp_ns", "point_x_mm", "sigma_mm", "rejected"]:
        assert [float(row[name]) for row in rows] == [float(value) for value in touches[name].to_pylist()], name
    features = json.loads((demo_folder / "features.json").read_text())["features"]
    table = parquet.read_table(tmp_path / "features.json.parquet").to_pylist()
    assert [row["id"] for row in table] == [feature["id"] for feature in features]
    for row, feature in zip(table, features):
        for key, value in feature.items():
            if isinstance(value, list) and len(value) == 3 and all(isinstance(x, (int, float)) for x in value):
                assert [row[f"{key}_{axis}"] for axis in "xyz"] == value
            elif isinstance(value, (int, float, str)):
                assert row[key] == value


def test_a_recording_that_became_a_table_comes_back_to_the_last_bit(touchup, demo_folder, tmp_path):
    """Written by pandas with all digits, poses and wrenches one below the other in the order of the recording."""
    columns = {
        POSE: ["x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"],
        WRENCH: ["fx_N", "fy_N", "fz_N", "tx_Nm", "ty_Nm", "tz_Nm"],
    }
    expected, rows = {POSE: [], WRENCH: []}, []
    with AnyReader([demo_folder / "touch.mcap"], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        for connection, _, payload in itertools.islice(reader.messages(), 4000):
            stamp, _, found = numbers(reader.deserialize(payload, connection.msgtype))
            expected[connection.topic].append((stamp, found))
            rows.append({"t_ns": stamp, **dict(zip(columns[connection.topic], found))})
    pandas.DataFrame(rows, columns=["t_ns", *columns[POSE], *columns[WRENCH]]).to_csv(tmp_path / "touch.csv", index=False)
    (tmp_path / "scene.yaml").write_text("columns: {wrench_axes: tip}\n")
    poses, wrenches, _ = converted(touchup, tmp_path, tmp_path / "touch.csv", "--scene", tmp_path / "scene.yaml")
    assert [[(stamp, row) for stamp, _, row in found] for found in (poses, wrenches)] == [expected[POSE], expected[WRENCH]]
    assert len(poses) > 1000 and len(wrenches) > 1000
    # its axes are those of the tip, as of the recording
    assert {frame for _, frame, _ in wrenches} == {"stylus"}
