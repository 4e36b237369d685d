"""Writes tests/data/ros_cdr.json: messages with every field filled, as bytes of CDR by rosbags and as names with values.

    python tests/python/make_ros_cdr.py > tests/data/ros_cdr.json
"""

import itertools
import json
import re
from pathlib import Path

import numpy
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

ROOT = Path(__file__).resolve().parents[2]
STANDARD = [
    *(f"builtin_interfaces/msg/{name}" for name in ["Time", "Duration"]),
    *(f"std_msgs/msg/{name}" for name in ["Header", "ColorRGBA"]),
    *(f"geometry_msgs/msg/{name}" for name in ["Point", "Vector3", "Quaternion", "Pose", "Transform", "Wrench"]),
    *(f"geometry_msgs/msg/{name}" for name in ["PointStamped", "PoseStamped", "WrenchStamped", "TransformStamped"]),
    *(f"diagnostic_msgs/msg/{name}" for name in ["KeyValue", "DiagnosticStatus", "DiagnosticArray"]),
    *(f"visualization_msgs/msg/{name}" for name in ["UVCoordinate", "MeshFile", "Marker", "MarkerArray"]),
    *(f"rcl_interfaces/msg/{name}" for name in ["FloatingPointRange", "IntegerRange", "ListParametersResult", "Parameter"]),
    *(f"rcl_interfaces/msg/Parameter{name}" for name in ["Descriptor", "Event", "Value"]),
    "rcl_interfaces/msg/SetParametersResult",
    "tf2_msgs/msg/TFMessage",
    "rosgraph_msgs/msg/Clock",
    "nav_msgs/msg/Path",
    "sensor_msgs/msg/CompressedImage",
    "sensor_msgs/msg/JointState",
    "trajectory_msgs/msg/JointTrajectory",
    "trajectory_msgs/msg/JointTrajectoryPoint",
]
# std_srvs and rcl_interfaces as in their files; an empty request has one byte
SERVICES = {
    "rcl_interfaces/srv/GetParameters_Request": "string[] names",
    "rcl_interfaces/srv/GetParameters_Response": "rcl_interfaces/msg/ParameterValue[] values",
    "rcl_interfaces/srv/GetParameterTypes_Request": "string[] names",
    "rcl_interfaces/srv/GetParameterTypes_Response": "uint8[] types",
    "rcl_interfaces/srv/ListParameters_Request": "string[] prefixes\nuint64 depth",
    "rcl_interfaces/srv/ListParameters_Response": "rcl_interfaces/msg/ListParametersResult result",
    "rcl_interfaces/srv/DescribeParameters_Request": "string[] names",
    "rcl_interfaces/srv/DescribeParameters_Response": "rcl_interfaces/msg/ParameterDescriptor[] descriptors",
    "rcl_interfaces/srv/SetParameters_Request": "rcl_interfaces/msg/Parameter[] parameters",
    "rcl_interfaces/srv/SetParameters_Response": "rcl_interfaces/msg/SetParametersResult[] results",
    "rcl_interfaces/srv/SetParametersAtomically_Request": "rcl_interfaces/msg/Parameter[] parameters",
    "rcl_interfaces/srv/SetParametersAtomically_Response": "rcl_interfaces/msg/SetParametersResult result",
    "std_srvs/srv/Trigger_Request": "uint8 structure_needs_at_least_one_member",
    "std_srvs/srv/Trigger_Response": "bool success\nstring message",
    "std_srvs/srv/SetBool_Request": "bool data",
    "std_srvs/srv/SetBool_Response": "bool success\nstring message",
}
PARTS = {"msg": [""], "srv": ["_Request", "_Response"], "action": ["_Goal", "_Result", "_Feedback"]}


def definitions():
    """Name and text of every message of ours."""
    found = dict(SERVICES)
    for kind, parts in PARTS.items():
        for path in sorted((ROOT / "msg" / kind).iterdir()):
            texts = re.split(r"^---$", path.read_text(), flags=re.MULTILINE)
            found.update((f"touchup_msgs/{kind}/{path.stem}{part}", text) for part, text in zip(parts, texts, strict=True))
    # within a package a type name may omit the package
    own = [name.rsplit("/", 1)[1] for name in found if name.startswith("touchup_msgs/msg/")]
    alone = re.compile(rf"^({'|'.join(own)})(?=[ \[])", re.MULTILINE)
    return {name: alone.sub(r"touchup_msgs/msg/\1", text) for name, text in found.items()}


def known(name):
    """The name as rosbags has it, which does not know services."""
    return "/msg/".join(name.rsplit("/", 1)) if "/srv/" in name else name


def filled(store, name, numbers):
    """A message with another value in every field."""

    def value(name):
        number = next(numbers)
        if name == "string":
            return f"word {number} \u00d8"
        if name == "bool":
            return number % 2 == 1
        return float(number) + 0.25 if name.startswith("float") else number % 120

    def field(node):
        kind, of = node
        if kind == 1:
            return value(of[0])
        if kind == 2:
            return filled(store, of, numbers)
        item = of[0]
        count = of[1] if kind == 3 else 3
        items = [field(item) for _ in range(count)]
        is_number = item[0] == 1 and item[1][0] != "string"
        kinds = {"byte": "uint8", "char": "uint8"}
        return numpy.array(items, dtype=kinds.get(item[1][0], item[1][0])) if is_number else items

    name = known(name)
    _, fields = store.fielddefs[name]
    return store.types[name](**{key: field(node) for key, node in fields})


def plain(value):
    """Names and values, as JSON has them."""
    if hasattr(value, "__dataclass_fields__"):
        # rosbags makes fields of constants too, in capitals
        names = [name for name in value.__dataclass_fields__ if name != "__msgtype__" and not name.isupper()]
        return {name: plain(getattr(value, name)) for name in names}
    if isinstance(value, (list, numpy.ndarray)):
        return [plain(item) for item in value]
    return value.item() if isinstance(value, numpy.generic) else value


def types():
    """Everything that rosbags knows of the messages: its own definitions, and ours as it reads them."""
    store = get_typestore(Stores.ROS2_JAZZY)
    found = {}
    for name, text in definitions().items():
        found.update(get_types_from_msg(text, name))
    store.register({name: kind for name, kind in found.items() if name not in store.fielddefs})
    return store


def made():
    """Type name -> bytes after the encapsulation, as hexadecimal digits, and fields."""
    store = types()
    found = {}
    for name in [*STANDARD, *definitions()]:
        message = filled(store, name, itertools.count(1))
        cdr = bytes(store.serialize_cdr(message, known(name)))
        assert cdr[:4] == b"\x00\x01\x00\x00"
        found[name] = {"cdr": cdr[4:].hex(), "fields": plain(message)}
    return found


if __name__ == "__main__":
    print(json.dumps(made(), indent=1, ensure_ascii=False))
