"""Messages of ROS 2 as CycloneDDS has them, and the quality of service of rmw_cyclonedds."""

from dataclasses import dataclass
from types import new_class

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import float32, float64, int32, int64, sequence, uint8, uint32, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

# as ROS 2 writes it: XCDR version 1
WIRE = Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False)
BEST_EFFORT = Qos(Policy.Reliability.BestEffort, Policy.Durability.Volatile, Policy.History.KeepLast(1000), WIRE)
RELIABLE = Qos(Policy.Reliability.Reliable(duration(seconds=10)), Policy.Durability.Volatile, Policy.History.KeepAll, WIRE)
LATCHED = Qos(
    Policy.Reliability.Reliable(duration(seconds=10)), Policy.Durability.TransientLocal, Policy.History.KeepLast(8192), WIRE
)


def message(name):
    """Makes a dataclass a message: message("std_msgs/msg/Header")."""
    package, kind, type_name = name.split("/")

    def make(cls):
        typename = f"{package}::{kind}::dds_::{type_name}_"
        fields = {"__annotations__": cls.__annotations__, "__module__": cls.__module__}
        made = new_class(cls.__name__, (IdlStruct,), {"typename": typename}, lambda namespace: namespace.update(fields))
        return final(dataclass(made))

    return make


@message("builtin_interfaces/msg/Time")
class Time:
    sec: int32
    nanosec: uint32


@message("builtin_interfaces/msg/Duration")
class Duration:
    sec: int32
    nanosec: uint32


@message("std_msgs/msg/Header")
class Header:
    stamp: Time
    frame_id: str


@message("geometry_msgs/msg/Vector3")
class Vector3:
    x: float64
    y: float64
    z: float64


@message("geometry_msgs/msg/Point")
class Point:
    x: float64
    y: float64
    z: float64


@message("geometry_msgs/msg/Quaternion")
class Quaternion:
    x: float64
    y: float64
    z: float64
    w: float64


@message("geometry_msgs/msg/Pose")
class Pose:
    position: Point
    orientation: Quaternion


@message("geometry_msgs/msg/Wrench")
class Wrench:
    force: Vector3
    torque: Vector3


@message("geometry_msgs/msg/WrenchStamped")
class WrenchStamped:
    header: Header
    wrench: Wrench


@message("geometry_msgs/msg/PoseStamped")
class PoseStamped:
    header: Header
    pose: Pose


@message("touchup_msgs/msg/HapticMismatch")
class HapticMismatch:
    header: Header
    contact_case: uint8
    face: uint32
    mesh_version: uint64
    tip: Point
    actual_force: Vector3
    expected_force: Vector3
    linear: Vector3
    rotational: Vector3
    signed_distance: float64


@message("std_msgs/msg/ColorRGBA")
class ColorRGBA:
    r: float32
    g: float32
    b: float32
    a: float32


@message("sensor_msgs/msg/CompressedImage")
class CompressedImage:
    header: Header
    format: str
    data: sequence[uint8]


@message("visualization_msgs/msg/UVCoordinate")
class UVCoordinate:
    u: float32
    v: float32


@message("visualization_msgs/msg/MeshFile")
class MeshFile:
    filename: str
    data: sequence[uint8]


@message("visualization_msgs/msg/Marker")
class Marker:
    header: Header
    ns: str
    id: int32
    type: int32
    action: int32
    pose: Pose
    scale: Vector3
    color: ColorRGBA
    lifetime: Duration
    frame_locked: bool
    points: sequence[Point]
    colors: sequence[ColorRGBA]
    texture_resource: str
    texture: CompressedImage
    uv_coordinates: sequence[UVCoordinate]
    text: str
    mesh_resource: str
    mesh_file: MeshFile
    mesh_use_embedded_materials: bool


# services: rmw_cyclonedds puts the caller's id and the number of the call before each message
@message("touchup_msgs/srv/Undo_Request")
class UndoRequest:
    guid: uint64
    seq: int64
    strokes: uint32


@message("touchup_msgs/srv/Undo_Response")
class UndoResponse:
    guid: uint64
    seq: int64
    success: bool
    message: str
    strokes: uint32
    mesh_version: uint64


@message("rcl_interfaces/msg/ParameterValue")
class ParameterValue:
    type: uint8
    bool_value: bool
    integer_value: int64
    double_value: float64
    string_value: str
    byte_array_value: sequence[uint8]
    bool_array_value: sequence[bool]
    integer_array_value: sequence[int64]
    double_array_value: sequence[float64]
    string_array_value: sequence[str]


@message("rcl_interfaces/msg/Parameter")
class Parameter:
    name: str
    value: ParameterValue


@message("rcl_interfaces/msg/SetParametersResult")
class SetParametersResult:
    successful: bool
    reason: str


@message("rcl_interfaces/srv/SetParameters_Request")
class SetParametersRequest:
    guid: uint64
    seq: int64
    parameters: sequence[Parameter]


@message("rcl_interfaces/srv/SetParameters_Response")
class SetParametersResponse:
    guid: uint64
    seq: int64
    results: sequence[SetParametersResult]


@message("rcl_interfaces/srv/GetParameters_Request")
class GetParametersRequest:
    guid: uint64
    seq: int64
    names: sequence[str]


@message("rcl_interfaces/srv/GetParameters_Response")
class GetParametersResponse:
    guid: uint64
    seq: int64
    values: sequence[ParameterValue]


def parameter_value(value=None):
    """A ParameterValue of a bool, int, float or str."""
    made = ParameterValue(0, False, 0, 0.0, "", [], [], [], [], [])
    for number, (kind, field) in enumerate([(bool, "bool"), (int, "integer"), (float, "double"), (str, "string")], 1):
        if type(value) is kind:
            made.type = number
            setattr(made, f"{field}_value", value)
    return made


class Peer:
    """Another node in the domain."""

    def __init__(self, domain):
        self.participant = DomainParticipant(domain)

    def writer(self, name, kind, qos):
        return DataWriter(self.participant, Topic(self.participant, f"rt{name}", kind, qos=qos), qos=qos)

    def reader(self, name, kind, qos):
        return DataReader(self.participant, Topic(self.participant, f"rt{name}", kind, qos=qos), qos=qos)

    def client(self, name, request, response):
        asked = Topic(self.participant, f"rq{name}Request", request, qos=RELIABLE)
        answered = Topic(self.participant, f"rr{name}Reply", response, qos=RELIABLE)
        return (
            DataWriter(self.participant, asked, qos=RELIABLE),
            DataReader(self.participant, answered, qos=RELIABLE),
        )
