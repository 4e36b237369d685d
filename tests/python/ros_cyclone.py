"""Messages of ROS 2 as CycloneDDS has them, and the quality of service of rmw_cyclonedds."""

from dataclasses import dataclass
from types import new_class

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import array, float32, float64, int8, int32, int64, sequence, uint8, uint32, uint64
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


@message("rosgraph_msgs/msg/Clock")
class Clock:
    clock: Time


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


# peers that end too early
@message("geometry_msgs/msg/WrenchStamped")
class HeaderAlone:
    header: Header


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


@message("visualization_msgs/msg/MarkerArray")
class MarkerArray:
    markers: sequence[Marker]


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


@message("touchup_msgs/srv/SaveMesh_Request")
class SaveMeshRequest:
    guid: uint64
    seq: int64
    name: str
    overwrite: bool
    with_features: bool
    with_step: bool


@message("touchup_msgs/srv/SaveMesh_Response")
class SaveMeshResponse:
    guid: uint64
    seq: int64
    success: bool
    message: str
    path: str
    mesh_version: uint64
    vertex_count: uint32
    face_count: uint32


@message("diagnostic_msgs/msg/KeyValue")
class KeyValue:
    key: str
    value: str


@message("diagnostic_msgs/msg/DiagnosticStatus")
class DiagnosticStatus:
    level: uint8
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@message("diagnostic_msgs/msg/DiagnosticArray")
class DiagnosticArray:
    header: Header
    status: sequence[DiagnosticStatus]


@message("rcl_interfaces/msg/Log")
class Log:
    stamp: Time
    level: uint8
    name: str
    msg: str
    file: str
    function: str
    line: uint32


@message("touchup_msgs/msg/MeshPatch")
class MeshPatch:
    header: Header
    session: str
    version: uint64
    base_version: uint64
    part: uint32
    part_count: uint32
    removed_faces: sequence[uint32]
    vertices: sequence[uint32]
    positions: sequence[float32]
    variance: sequence[float32]
    support: sequence[uint8]
    faces: sequence[uint32]
    corners: sequence[uint32]
    removed_vertices: sequence[uint32]
    vertex_count: uint32
    face_count: uint32


@message("touchup_msgs/srv/ResyncMesh_Request")
class ResyncMeshRequest:
    guid: uint64
    seq: int64
    session: str
    version: uint64


@message("touchup_msgs/srv/ResyncMesh_Response")
class ResyncMeshResponse:
    guid: uint64
    seq: int64
    success: bool
    message: str
    session: str
    version: uint64


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


@message("rcl_interfaces/srv/GetParameterTypes_Request")
class GetParameterTypesRequest:
    guid: uint64
    seq: int64
    names: sequence[str]


@message("rcl_interfaces/srv/GetParameterTypes_Response")
class GetParameterTypesResponse:
    guid: uint64
    seq: int64
    types: sequence[uint8]


@message("rcl_interfaces/srv/ListParameters_Request")
class ListParametersRequest:
    guid: uint64
    seq: int64
    prefixes: sequence[str]
    depth: uint64


@message("rcl_interfaces/msg/ListParametersResult")
class ListParametersResult:
    names: sequence[str]
    prefixes: sequence[str]


@message("rcl_interfaces/srv/ListParameters_Response")
class ListParametersResponse:
    guid: uint64
    seq: int64
    result: ListParametersResult


@message("rcl_interfaces/msg/FloatingPointRange")
class FloatingPointRange:
    from_value: float64
    to_value: float64
    step: float64


@message("rcl_interfaces/msg/IntegerRange")
class IntegerRange:
    from_value: int64
    to_value: int64
    step: uint64


@message("rcl_interfaces/msg/ParameterDescriptor")
class ParameterDescriptor:
    name: str
    type: uint8
    description: str
    additional_constraints: str
    read_only: bool
    dynamic_typing: bool
    floating_point_range: sequence[FloatingPointRange]
    integer_range: sequence[IntegerRange]


@message("rcl_interfaces/srv/DescribeParameters_Request")
class DescribeParametersRequest:
    guid: uint64
    seq: int64
    names: sequence[str]


@message("rcl_interfaces/srv/DescribeParameters_Response")
class DescribeParametersResponse:
    guid: uint64
    seq: int64
    descriptors: sequence[ParameterDescriptor]


@message("touchup_msgs/msg/ProbeSettings")
class ProbeSettings:
    quantity: uint8
    tolerance: float64
    confidence: float64
    pattern: uint8
    max_touches: uint32
    max_duration: float64
    max_force: float64
    max_search_speed: float64
    max_link_speed: float64
    max_search_travel: float64
    dry_run: bool


@message("geometry_msgs/msg/PointStamped")
class PointStamped:
    header: Header
    point: Point


@message("touchup_msgs/msg/FormDeviation")
class FormDeviation:
    characteristic: uint8
    zone: float64
    zone_std: float64
    least_squares: float64
    coverage: float64
    undulations: uint32
    lobes: sequence[uint32]


@message("touchup_msgs/msg/Feature")
class Feature:
    id: uint32
    kind: uint8
    status: uint8
    fitted_to: uint8
    touched: float64
    touch_count: uint32
    search_radius: float64
    center: Point
    center_std: float64
    axis: Vector3
    axis_std: float64
    direction: Vector3
    diameter: float64
    diameter_std: float64
    length: float64
    length_std: float64
    width: float64
    width_std: float64
    depth: float64
    depth_std: float64
    depth_is_at_least: bool
    cone_angle: float64
    cone_angle_std: float64
    through: uint8
    convex: uint8
    group: int32
    points: sequence[Point]
    form: sequence[FormDeviation]


@message("touchup_msgs/msg/Relation")
class Relation:
    kind: uint8
    of_feature: uint32
    to_feature: uint32
    zone: float64
    zone_std: float64
    angle: float64
    angle_std: float64
    distance: float64
    distance_std: float64
    concentricity: float64
    concentricity_std: float64


@message("touchup_msgs/msg/FeatureArray")
class FeatureArray:
    header: Header
    session: str
    mesh_version: uint64
    features: sequence[Feature]
    relations: sequence[Relation]
    unexplained: float64


@message("touchup_msgs/srv/DetectFeatures_Request")
class DetectFeaturesRequest:
    guid: uint64
    seq: int64
    kinds: sequence[uint8]


@message("touchup_msgs/srv/DetectFeatures_Response")
class DetectFeaturesResponse:
    guid: uint64
    seq: int64
    success: bool
    message: str
    mesh_version: uint64
    count: uint32
    ids: sequence[uint32]


@message("touchup_msgs/msg/ProbeTouch")
class ProbeTouch:
    header: Header
    id: uint32
    index: uint32
    verdict: uint8
    accepted: bool
    reason: str
    pose: Pose
    contact: Point
    contact_std: float64
    normal: Vector3
    approach: Vector3
    deviation: float64
    speed: float64
    tip_radius: float64
    calibration: str
    peak_wrench: Wrench
    curve_time: sequence[float32]
    curve_travel: sequence[float32]
    curve_force: sequence[float32]
    curve_lateral_force: sequence[float32]


@message("touchup_msgs/msg/ProbeResult")
class ProbeResult:
    header: Header
    id: uint32
    code: uint8
    message: str
    feature: Feature
    uncertainty: float64
    duration: float64
    max_force: float64
    touch_count: uint32


@message("touchup_msgs/srv/FlagFeature_Request")
class FlagFeatureRequest:
    guid: uint64
    seq: int64
    kind: uint8
    point: PointStamped
    search_radius: float64


@message("touchup_msgs/srv/FlagFeature_Response")
class FlagFeatureResponse:
    guid: uint64
    seq: int64
    success: bool
    message: str
    id: uint32


@message("touchup_msgs/srv/ProbeFeature_Request")
class ProbeFeatureRequest:
    guid: uint64
    seq: int64
    id: uint32
    settings: ProbeSettings


@message("touchup_msgs/srv/ProbeFeature_Response")
class ProbeFeatureResponse:
    guid: uint64
    seq: int64
    result: ProbeResult


# an empty message has one byte on the wire
@message("std_srvs/srv/Trigger_Request")
class TriggerRequest:
    guid: uint64
    seq: int64
    structure_needs_at_least_one_member: uint8


@message("std_srvs/srv/Trigger_Response")
class TriggerResponse:
    guid: uint64
    seq: int64
    success: bool
    message: str


@message("std_srvs/srv/SetBool_Request")
class SetBoolRequest:
    guid: uint64
    seq: int64
    data: bool


@message("std_srvs/srv/SetBool_Response")
class SetBoolResponse:
    guid: uint64
    seq: int64
    success: bool
    message: str


@message("touchup_msgs/action/Probe_SendGoal_Request")
class SendGoalRequest:
    guid: uint64
    seq: int64
    goal_id: array[uint8, 16]
    ids: sequence[uint32]
    settings: ProbeSettings


@message("touchup_msgs/action/Probe_SendGoal_Response")
class SendGoalResponse:
    guid: uint64
    seq: int64
    accepted: bool
    stamp: Time


@message("touchup_msgs/action/Probe_GetResult_Request")
class GetResultRequest:
    guid: uint64
    seq: int64
    goal_id: array[uint8, 16]


@message("touchup_msgs/action/Probe_GetResult_Response")
class GetResultResponse:
    guid: uint64
    seq: int64
    status: int8
    header: Header
    code: uint8
    message: str
    ids: sequence[uint32]
    codes: sequence[uint8]


@message("touchup_msgs/action/Probe_FeedbackMessage")
class FeedbackMessage:
    goal_id: array[uint8, 16]
    id: uint32
    feature: uint32
    feature_count: uint32
    phase: uint8
    touch: uint32
    touch_count: uint32
    force: float64
    uncertainty: float64
    elapsed: float64


@message("action_msgs/msg/GoalInfo")
class GoalInfo:
    goal_id: array[uint8, 16]
    stamp: Time


@message("action_msgs/srv/CancelGoal_Request")
class CancelGoalRequest:
    guid: uint64
    seq: int64
    goal_info: GoalInfo


@message("action_msgs/srv/CancelGoal_Response")
class CancelGoalResponse:
    guid: uint64
    seq: int64
    return_code: int8
    goals_canceling: sequence[GoalInfo]


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
