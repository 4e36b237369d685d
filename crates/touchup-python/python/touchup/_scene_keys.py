"""The keys of a scene as typed dictionaries; written by generate_scene_keys.py from the definition of the parameters."""

from __future__ import annotations

from typing import Literal, TypedDict


class Sync(TypedDict, total=False):
    """Pairing of poses with wrenches: interpolates the pose at the stamp of each wrench. Off: only messages of
    equal stamp pair."""

    reorder_ms: float
    """Largest lag of a message behind the newest stamp of its stream; each sample waits for this time. — [ms] 0
    to 60000; default `20`"""

    largest_gap_ms: float
    """Largest time between the two poses around a wrench; a wrench in a longer gap makes no sample. — [ms] 0 to
    60000; default `30`"""

    largest_jump_s: float
    """Largest step of a stamp ahead of its stream; a message beyond it counts only if the next four agree with
    it. — [s] 0 to 1e+06; default `0.1`"""

    wrench_offset_ms: float
    """Offset of the wrench clock, positive if it is ahead of the pose clock; pairing subtracts it from the
    stamps of the wrenches. — [ms] -60000 to 60000; default `0`"""

    wrench_drift_ppm: float
    """Drift of the wrench clock from the first wrench on, positive if it gains on the pose clock; pairing
    subtracts it beside the offset. — [ppm] -1000 to 1000; default `0`"""

    capacity: float
    """Maximum number of messages held for each stream. — [messages] 2 to 1e+06; default `4096`"""


class Columns(TypedDict, total=False):
    """Columns of a recording that is a table (CSV, or the log of a UR's RTDE), by their names in the first
    line, each with its unit, as in x_mm or `x [mm]`. Not named: the usual names and those of RTDE apply."""

    time: str
    """Column of the time: s, ms, us or ns."""

    position: list[str]
    """Position of the tip, three columns: m, mm, um or inch."""

    orientation: list[str]
    """Orientation of the tip: a quaternion x, y, z, w, or a rotation vector of three columns in rad or deg.
    Left out and without a usual name in the table: none, which suffices for a ball with wrenches in the axes of
    the positions."""

    force: list[str]
    """Force of the part on the stylus, three columns: N or kN."""

    torque: list[str]
    """Torque of the part on the stylus, three columns: Nm or Nmm. Left out and without a usual name in the
    table: 0."""

    wrench_axes: Literal["pose", "tip"]
    """Axes of force and torque: those of the positions (pose), or those of the tip, turned by the orientation
    (tip).; default `pose`"""


class Clock(TypedDict, total=False):
    """Estimate of the delay of the wrench clock, from the onsets of contacts. The program reports it, and
    applies it only on request. It has no keys. Off: no estimate."""


class Markers(TypedDict, total=False):
    """Markers on the stylus, for recordings that hold them in place of its pose (--markers-topic): springs and
    dampers pull a rigid body to the visible markers. The default values are those of the simulated stylus."""

    positions_mm: list[list[float]]
    """Position of each marker from the centre of the ball, in the axes of the tip (z: along the shaft, tip to
    handle), in the order of labels from 0 on; 3 to 16 markers, not on one line. — [mm] -10000 to 10000; default
    `[[28, 0, 120], [-20, 22, 128], [-16, -26, 140], [18, 24, 155], [-30, 2, 168], [6, -22, 180]]`"""

    noise_mm: float
    """Standard deviation of the noise of a marker along each axis. — [mm] 1e-06 to 1000; default `0.15`"""

    gate_mm: float
    """Largest distance of a marker from its expected position; a farther one does not count as this marker.
    Less than half of the smallest distance between two markers. — [mm] 1e-06 to 1000; default `4`"""

    coast_ms: float
    """Longest time for which the body continues its motion while its markers do not determine it; after that
    there is no pose. — [ms] 0.001 to 10000; default `30`"""

    period_ms: float
    """Time between two poses. — [ms] 0.05 to 10000; default `1`"""

    reorder_ms: float
    """Largest lag of a frame behind the newest one. — [ms] 0 to 60000; default `20`"""

    spring_hz: float
    """Natural frequency √(k/m) / 2π of the springs between the body and its markers: a higher one follows
    faster, a lower one smooths more. — [Hz] 0.001 to 1e+06; default `12`"""

    damping: float
    """Damping ratio d / (2 √(k m)): 1 is the fastest without oscillation. — 0.5 to 100; default `1`"""


class ScanToSpace(TypedDict, total=False):
    """Pose of the scan in the frame of the recorded poses: p_space = R p_scan + t (`touchup calibrate scan`).
    Not named: the poses are in the frame of the scan."""

    position_mm: list[float]
    """Origin of the scan in the frame of the poses. — [mm] -1e+06 to 1e+06; default `[0, 0, 0]`"""

    orientation_xyzw: list[float]
    """Orientation of the scan in the frame of the poses, as a quaternion x, y, z, w. — [(length of the
    quaternion)] 0.999 to 1.001; default `[0, 0, 0, 1]`"""


class Changes(TypedDict, total=False):
    """What changed its place while the recording lasted (`touchup doctor`), one after the other: taken off the
    poses. A change lasts until the end of the recording. Not named: nothing moved but the stylus."""

    cause: Literal["part_moved", "tip_bent"]
    """What changed its place: the part or the frame of the recorded poses, or the ball on the stylus.; default
    `part_moved`"""

    from_s: float
    """Time of the change, or of its beginning, as the stamps of the poses have it. — [s] 0 to 9e+09"""

    to_s: float
    """End of a slow change, which goes on evenly until then; left out: all at once. — [s] 0 to 9e+09"""

    shift_mm: list[float]
    """Shift: of a part before it turns, in the axes of the scan; of a tip in the axes of the stylus. — [mm]
    -1000 to 1000; default `[0, 0, 0]`"""

    turn_deg: list[float]
    """Turn of a part about about_mm, as a rotation vector in the axes of the scan. — [degrees] -180 to 180;
    default `[0, 0, 0]`"""

    about_mm: list[float]
    """Centre of the turn, in the frame of the scan. — [mm] -1e+06 to 1e+06; default `[0, 0, 0]`"""

    shift_sigma_mm: list[float]
    """Standard uncertainty of the shift along each axis; the touches after the change contain it. — [mm] 0 to
    1000; default `[0, 0, 0]`"""

    turn_sigma_deg: list[float]
    """Standard uncertainty of the turn about each axis; the touches after the change contain it. — [degrees] 0
    to 180; default `[0, 0, 0]`"""


class CompensationPayload(TypedDict, total=False):
    """Payload of the sensor: everything beyond its measuring plane."""

    gravity_axes: Literal["object", "space"]
    """Axes of the vector of gravity: those of the scan (object), or those of the recorded poses, turned by
    scan_to_space (space).; default `object`"""

    mass_kg: float
    """Mass of the payload. — [kg] 0 to 1000; default `0`"""

    centre_mm: list[float]
    """Centre of mass of the payload from the origin of the sensor, in the axes of the sensor. — [mm] -10000 to
    10000; default `[0, 0, 0]`"""

    gravity_m_per_s2: list[float]
    """Acceleration of gravity, in gravity_axes. — [m/s²] -100 to 100; default `[0, 0, -9.81]`"""


class CompensationBias(TypedDict, total=False):
    """Bias of the sensor: its reading without contact and payload."""

    force_n: list[float]
    """Force of the bias, in the axes of the sensor. — [N] -10000 to 10000; default `[0, 0, 0]`"""

    torque_nm: list[float]
    """Torque of the bias, in the axes of the sensor. — [N·m] -10000 to 10000; default `[0, 0, 0]`"""


class Compensation(TypedDict, total=False):
    """Subtraction of weight and bias from the wrench (`touchup calibrate payload`). Not named: the driver of
    the sensor subtracts them, and the sensor has the axes of the tip."""

    payload: CompensationPayload | Literal[False, "off"] | None
    """Payload of the sensor: everything beyond its measuring plane."""

    bias: CompensationBias | Literal[False, "off"] | None
    """Bias of the sensor: its reading without contact and payload."""

    sensor_position_mm: list[float]
    """Origin of the sensor from the centre of the ball, in the axes of the tip (z: along the shaft, tip to
    handle). — [mm] -100000 to 100000; default `[0, 0, 0]`"""

    sensor_orientation_xyzw: list[float]
    """Orientation of the sensor in the frame of the tip, as a quaternion x, y, z, w; left out: the axes of the
    tip. — [(length of the quaternion)] 0.999 to 1.001"""


class BiasTracking(TypedDict, total=False):
    """Tracking of the slow drift of the sensor in free air. Not named: the bias stays constant."""

    settle_ms: float
    """Time of free motion (contact.free_n) before the tracking begins; a contact discards the drift tracked in
    this time before it. — [ms] 0.001 to 60000; default `60`"""

    time_s: float
    """Time constant of the running mean of the bias. — [s] 1e-06 to 1e+06; default `0.3`"""


class Contact(TypedDict, total=False):
    """Contact gate: separates contact from free motion by the measured force. Off: every sample counts as
    contact."""

    on_n: float
    """Force above which a contact begins; no less than off_n. — [N] 0 to 1000; default `0.4`"""

    off_n: float
    """Force below which a contact ends. — [N] 0 to 1000; default `0.22`"""

    free_n: float
    """Largest error of the zero of the sensor, below on_n: a force above it, beyond the noise, may be a light
    touch, which neither moves the mesh nor frees space. — [N] 0 to 1000; default `0.15`"""


class Tip(TypedDict, total=False):
    """Tip of the stylus: a ball, the flat end of a cylinder, or a cone with a round nose. The origin of the
    pose is the centre of the ball or nose, or the middle of the flat end; its z axis runs along the shaft, from
    the tip to the handle. Off: a rigid point."""

    shape: Literal["ball", "flat", "cone"]
    """Shape of the tip.; default `ball`"""

    offset_mm: list[float]
    """Centre of the ball from the origin of the recorded pose, in the axes of that pose (`touchup calibrate
    tip`); left out: 0. Positions of markers are from the origin of the recorded pose too. — [mm] -10000 to
    10000"""

    radius_mm: float
    """Radius of the ball, of the flat end, or of the nose of the cone. — [mm] 0 to 1000; default `1.5`"""

    stiffness_n_per_mm: float
    """Stiffness of stylus and holder at the ball; left out: rigid. — [N/mm] 0.001 to 1e+09; default `20`"""

    edge_radius_mm: float
    """Radius of the rounded edge of a flat tip, no more than radius_mm; left out: sharp. — [mm] 0 to 1000"""

    half_angle_deg: float
    """Angle between the axis and the flank of a cone. — [degrees] 1 to 80"""

    length_mm: float
    """Known length of a flat or conical tip from its origin, more than edge_radius_mm; left out: two diameters,
    no less than 5 mm. — [mm] 0.001 to 1000"""


class Scan(TypedDict, total=False):
    """Scan and its quality. Off: the scan is free of noise."""

    file: str
    """File of the scan, unless a flag or an argument names one: PLY, STL or OBJ, or a point cloud (PLY, PCD,
    XYZ or E57), relative to the folder of this scene."""

    unit: Literal["m", "mm", "inch"]
    """Unit of the coordinates in the file of the scan.; default `mm`"""

    region_low_mm: list[float]
    """Lowest corner of the box of the ball's centre in all touches, in the frame of the scan. Only the scan
    near the box gets adjacency and a tree; the result holds the rest of the scan unchanged. Touches outside the
    box are refused; an arm needs the whole scan, and the node shows only the part near the box. Name both
    corners; left out: no box. — [mm] -1e+06 to 1e+06"""

    region_high_mm: list[float]
    """Highest corner of the box of the ball's centre in all touches, in the frame of the scan. — [mm] -1e+06 to
    1e+06"""

    noise_mm: float
    """Standard deviation of the scan from the true surface. — [mm] 0 to 1000; default `0.6`"""


class Sliding(TypedDict, total=False):
    """Removal of friction from the measured normal while the ball slides, in the haptic update and in the
    patch. Off: the direction of the force is the normal. The keys are for the haptic update, which knows only
    the past; of them the patch uses only the cone, as it looks ahead."""

    smoothing_ms: float
    """Time constant of the filter on position and force. — [ms] 0 to 10000; default `6`"""

    velocity_smoothing_ms: float
    """Time constant of the filter on the velocity. — [ms] 0 to 10000; default `20`"""

    slowest_mm_per_s: float
    """Uncertainty of the velocity; below this speed the sliding direction hardly determines the normal. —
    [mm/s] 0 to 1e+06; default `8`"""

    cone_cosine: float
    """Cosine of the widest accepted friction cone; 0.9135 is 24 degrees, a friction coefficient of 0.45. — 0 to
    1; default `0.9135`"""


class Carve(TypedDict, total=False):
    """Carving and free space: the haptic update and the patch remove surface that the tip passes through
    without a force. Off: lids over holes stay. The keys are for carving, by the haptic update; in the patch
    free space counts as touches do."""

    rate_per_s: float
    """Share of the depth removed per second. — [1/s] 0 to 1e+06; default `300`"""

    tolerance_mm: float
    """Depth that carving leaves alone: the noise of the tracking. — [mm] 0 to 1000; default `0.05`"""

    contact_tolerance_mm: float
    """Depth that carving leaves alone during contact, because it may be the measured surface. — [mm] 0 to 1000;
    default `0.2`"""


class Guard(TypedDict, total=False):
    """Guard of the mesh: cuts back an update that would exceed one of these limits. Off: no limits, as in the
    paper, and the mesh of a noisy scan may diverge."""

    smallest_quality: float
    """Smallest quality of a triangle, twice its area over its longest edge squared: 0.15 is a sixfold stretch.
    For a thin triangle of the scan, nine tenths of its scanned quality if that is less. — 0 to 0.87; default
    `0.15`"""

    smallest_turn_cosine: float
    """Smallest cosine between the normals of a face before and after one update. — -1 to 1; default `0.5`"""

    smallest_evidence_cosine: float
    """Smallest cosine between the normal of a face and its last scanned or measured normal. — -1 to 1; default
    `0`"""

    smallest_fold_cosine: float
    """Smallest cosine between the normals of neighbouring faces: -0.85 is an angle of 148 degrees. — -1 to 1;
    default `-0.85`"""

    gap_edges: float
    """Distance in mean edge lengths below which faces count as touching. — [mean edges] 0 to 1; default
    `0.01`"""


class Patch(TypedDict, total=False):
    """Reconstruction of the touched surface, finer than the scan: edges are sharp, closed holes open, and the
    untouched scan stays unchanged. Off: the triangles of the scan stay and only move."""

    tolerance_mm: float
    """Largest distance of the new faces from the touched surface, on planes and in holes down to twice the
    width of the tip: a smaller one makes finer faces at edges and in holes, and takes longer. Left out: 1/64 of
    the radius of the tip. — [mm] 1e-06 to 100"""


class Uncertainty(TypedDict, total=False):
    """Uncertainty of each vertex (sigma_mm in the PLY), and rejection of outliers: touches that contradict
    their place. A second pass that confirms an outlier relocates the place. Needs patch. Off: every touch
    counts, and the result has no uncertainty."""

    gate_sigmas: float
    """Contradiction in standard deviations above which a contact is rejected as an outlier. — [standard
    deviations] 0.5 to 1e+06; default `4`"""

    radius_sigma_mm: float
    """Standard uncertainty of the calibrated radius of the tip; more touches do not reduce it, and each
    diameter and width contains it twice. — [mm] 0 to 1000; default `0.001`"""

    place_sigma_mm: float
    """Standard uncertainty of the calibrated centre of the tip and frame of the scan, along each axis; more
    touches do not reduce it, and each place contains it, but no size does. — [mm] 0 to 1000; default `0.002`"""

    stiffness_percent: float
    """Standard uncertainty of the calibrated stiffness of the tip. — [%] 0 to 100; default `2`"""


class RobotRos2Control(TypedDict, total=False):
    """Topics and sensor of an arm behind ros2_control (docs/ros2_control.md)."""

    joint_states_topic: str
    """Topic of joint_state_broadcaster.; default `/joint_states`"""

    wrench_topic: str
    """Topic of force_torque_sensor_broadcaster.; default `/force_torque_sensor_broadcaster/wrench`"""

    trajectory_topic: str
    """Topic of the orders to joint_trajectory_controller.; default
    `/joint_trajectory_controller/joint_trajectory`"""

    wrench_frame: str
    """Frame of the wrenches, as in their headers.; default `tool0`"""

    sensor_position_mm: list[float]
    """Origin of wrench_frame in the flange. — [mm] -1000 to 1000; default `[0, 0, 0]`"""

    sensor_orientation_xyzw: list[float]
    """Orientation of wrench_frame in the flange, as a quaternion x, y, z, w. — [(length of the quaternion)]
    0.999 to 1.001; default `[0, 0, 0, 1]`"""


class Robot(TypedDict, total=False):
    """Arm with a probe (`touchup probe`, docs/probing.md). Not named: no probing. A request can ask for less
    than these limits, never for more. The tip must be a ball, and scan_to_space is the pose of the scan in the
    base of the arm."""

    model: Literal["ur3e", "ur5e", "ur10e", "ur16e", "urdf"]
    """Model of the arm.; default `ur5e`"""

    urdf: str
    """Description of the arm for model: urdf, with its macros expanded, relative to the folder of this
    scene."""

    base_link: str
    """Link of the URDF whose frame is the base of the arm.; default `base_link`"""

    flange_link: str
    """Link of the URDF whose frame is the flange.; default `tool0`"""

    link_radius_mm: float
    """Radius of links without a simple shape in the URDF, as capsules from joint to joint. — [mm] 1 to 1000;
    default `60`"""

    check: str
    """Record that `touchup check --out` wrote, relative to the folder of this scene; its findings enter each
    ±."""

    check_days: float
    """Age up to which a check counts; each result notes an older one. — [days] 0.01 to 3650; default `30`"""

    temperature_c: float
    """Temperature of the cell; each result notes a difference of more than 5 K from that of the check. — [°C]
    -50 to 100"""

    allow_motion: bool
    """Permission for the arm to move; false: only planning and drawing.; default `false`"""

    host: str
    """Name or address of the controller; a simulated arm has none.; default ``"""

    site_packages: str
    """Folder that `touchup ur setup` prints (docs/ur.md); a simulated arm has none.; default ``"""

    ros2_control: RobotRos2Control | Literal[False, "off"] | None
    """Topics and sensor of an arm behind ros2_control (docs/ros2_control.md)."""

    payload_kg: float
    """Mass of everything on the flange (`touchup calibrate payload --robot`). — [kg] 0 to 50; default `0.25`"""

    payload_centre_mm: list[float]
    """Centre of mass of everything on the flange, in the flange. — [mm] -1000 to 1000; default `[0, 0, 50]`"""

    tip_position_mm: list[float]
    """Centre of the ball in the flange. — [mm] -2000 to 2000; default `[0, 0, 150]`"""

    tip_orientation_xyzw: list[float]
    """Orientation of the tip in the flange (z: along the shaft, tip to handle), as a quaternion x, y, z, w. —
    [(length of the quaternion)] 0.999 to 1.001; default `[1, 0, 0, 0]`"""

    tolerance_mm: float
    """Required ± of the numbers of a feature, with the probability `confidence`. — [mm] 0.0001 to 10; default
    `0.05`"""

    confidence: float
    """Probability that the numbers of a feature are within the required ±. — 0.5 to 0.9999; default `0.95`"""

    workspace_low_mm: list[float]
    """Lowest corner of the box that the centre of the ball must not leave, in the base of the arm; the default
    box is a single point, so the arm cannot move. — [mm] -5000 to 5000; default `[0, 0, 0]`"""

    workspace_high_mm: list[float]
    """Highest corner of the box that the centre of the ball must not leave, in the base of the arm; no less
    than workspace_low_mm. — [mm] -5000 to 5000; default `[0, 0, 0]`"""

    arm_low_mm: list[float]
    """Lowest corner of the box that the arm except its base must not leave, bounded by table and walls for
    example, in the base of the arm; left out: no such bound. — [mm] -5000 to 5000"""

    arm_high_mm: list[float]
    """Highest corner of the box that the arm except its base must not leave, in the base of the arm; left out:
    no such bound. — [mm] -5000 to 5000"""

    largest_force_n: float
    """Force at the tip that stops every motion; well below the limit of the arm's own safety system. — [N] 0.1
    to 100; default `15`"""

    largest_mm_per_s: float
    """Largest speed of the tip. — [mm/s] 0.1 to 250; default `100`"""

    largest_joint_deg_per_s: float
    """Largest speed of a joint; joints turn fast near singular poses. — [degrees/s] 1 to 360; default `90`"""

    acceleration_mm_per_s2: float
    """Acceleration of the tip in every motion. — [mm/s²] 10 to 5000; default `500`"""

    fault_stop_mm_per_s2: float
    """Deceleration of the tip in a stop at a fault or at an unexpected contact. With tip.stiffness_n_per_mm it
    limits the speed of every motion, so that the force at such a contact stays below largest_force_n. — [mm/s²]
    10 to 10000; default `5000`"""

    largest_tare_n: float
    """Largest force at rest at which the sensor may be zeroed; a larger one means contact. — [N] 0.1 to 100;
    default `5`"""

    search_mm: float
    """Largest travel of one search. — [mm] 0.5 to 100; default `15`"""

    time_s: float
    """Longest time for one feature. — [s] 1 to 86400; default `600`"""

    least_dexterity: float
    """Smallest distance of the arm from singular poses: smallest singular value of its Jacobian, lengths over
    its reach. — 0 to 1; default `0.02`"""

    touch_force_n: float
    """Pressing force of a touch, no more than largest_force_n. — [N] 0.1 to 100; default `3`"""

    trigger_n: float
    """Force that ends a search: several standard deviations of the noise, no more than 0.8 of touch_force_n. —
    [N] 0.05 to 80; default `1`"""

    link_mm_per_s: float
    """Speed through free air. — [mm/s] 0.1 to 250; default `50`"""

    search_mm_per_s: float
    """Largest speed of a search; tip.stiffness_n_per_mm may lower it. — [mm/s] 0.1 to 250; default `10`"""

    measure_mm_per_s: float
    """Speed of the second search of a touch, which measures. — [mm/s] 0.05 to 250; default `2`"""

    slide_mm_per_s: float
    """Largest speed of the ball in a slide over a feature. — [mm/s] 0.1 to 250; default `10`"""

    latency_ms: float
    """Time from a contact to the start of braking. — [ms] 0 to 200; default `20`"""

    force_noise_n: float
    """Standard deviation of the noise of the measured force. — [N] 0.0001 to 10; default `0.15`"""

    clearance_mm: float
    """Distance of the ball from the surface at the start of a search. — [mm] 0.5 to 50; default `3`"""

    depth_mm: float
    """Depth of the centre of the ball in a hole. — [mm] 0 to 100; default `5`"""

    touches: float
    """Maximum number of touches of one feature. — [touches] 1 to 10000; default `39`"""

    touch_sigma_mm: float
    """Standard deviation of one touch due to the repeatability of arm and probe (`touchup check`), beside that
    of its own force curve. — [mm] 1e-05 to 1; default `0.03`"""

    square_sigma_deg: float
    """Standard uncertainty of the perpendicularity of the walls of holes, slots and bosses to the surface
    around them, in each of two directions, unless their touches measure it. — [degrees] 0.001 to 20; default
    `0.13`"""

    radius_sigma_mm: float
    """Standard uncertainty of the radius of the ball: each diameter, width and length contains it twice, the
    place of a plane once. — [mm] 0 to 10; default `0.001`"""

    place_sigma_mm: float
    """Standard uncertainty of the position of the scan in the base (scan_to_space), along each axis; 0: places
    are relative to the scan as the scene puts it. — [mm] 0 to 100; default `0`"""

    turn_sigma_deg: float
    """Standard uncertainty of the orientation of the scan in the base, about each axis; its effect grows with
    the distance from registered_at_mm. — [degrees] 0 to 20; default `0`"""

    growth_mm_per_m: float
    """Growth of the uncertainty of places with each metre from registered_at_mm, due to the kinematics of the
    arm: joints and lengths. — [mm/m] 0 to 100; default `0`"""

    registered_at_mm: list[float]
    """Best known place of the scan, in the frame of the scan: the middle of the features or spheres of its
    registration. — [mm] -1e+06 to 1e+06; default `[0, 0, 0]`"""

    shaft_radius_mm: float
    """Radius of the shaft behind the ball. — [mm] 0.05 to 50; default `1`"""

    shaft_length_mm: float
    """Length of the shaft, with the hand behind it, that must keep clear of the mesh. — [mm] 0 to 500; default
    `60`"""

    margin_mm: float
    """Margin for the error of the scan, in moves through free air. — [mm] 0 to 50; default `0.5`"""


class Refine(TypedDict, total=False):
    """Haptic update: moves the mesh until measured and expected force agree. Off: the mesh stays."""

    mode: Literal["robust", "paper"]
    """Rule of the haptic update: robust, for real scans, or paper, the published rule without contact, sliding,
    carve, guard and patch, even if the scene names them.; default `robust`"""

    contact_model: Literal["sigmoid", "spring"]
    """Model of the expected force over depth: the sigmoid of Eq 3, or the spring of the tip; left out: the
    spring in mode robust if its stiffness is known, else the sigmoid."""

    alpha_m_per_n_s: float
    """Speed of a face for each newton of mismatch (Eq 6); left out: the value of the mode. — [m/(N·s)] 0 to
    1e+06"""

    beta_per_n2_s: float
    """Turning speed of a face for each square newton of mismatch (Eq 7); left out: the value of the mode. —
    [1/(N²·s)] 0 to 1e+09"""

    turning_per_s: float
    """Turning rate of a face to the measured normal, independent of the force, in place of beta; left out: the
    value of the mode, or off if beta_per_n2_s is given. — [1/s] 0 to 1e+06"""

    step: Literal["lie", "corrected", "bounded", "dp5"]
    """Integration of position and normal: one after the other (lie), with a correction (corrected), coupled to
    1e-9 (bounded, as with mode paper), or by adaptive Runge–Kutta (dp5); left out: the value of the mode."""

    along: Literal["normal0", "force"]
    """Direction of the motion of a face: the normal at the start of the sample (normal0, Eq 6), or the force
    (force); left out: the value of the mode."""

    roi_mm: float
    """Radius of the region of interest: vertices within this distance of the touched face follow it; left out:
    the radius of the ball or the size of another tip, for a ball in mode paper one ring of faces. — [mm] 0 to
    1000"""

    f_max_n: float
    """Largest force of the sigmoid of Eq 3. — [N] 1e-06 to 1e+06; default `10`"""

    h_min_mm: float
    """Width of the sigmoid of Eq 3. — [mm] 1e-09 to 1e+06; default `0.5`"""

    delta: float
    """Shift of the sigmoid of Eq 3. — -50 to 50; default `5`"""


class Scene(TypedDict, total=False):
    """Differences from the default scene; False or "off" leaves out a part."""

    sync: Sync | Literal[False, "off"] | None
    """Pairing of poses with wrenches: interpolates the pose at the stamp of each wrench. Off: only messages of
    equal stamp pair."""

    columns: Columns | Literal[False, "off"] | None
    """Columns of a recording that is a table (CSV, or the log of a UR's RTDE), by their names in the first
    line, each with its unit, as in x_mm or `x [mm]`. Not named: the usual names and those of RTDE apply."""

    clock: Clock | Literal[False, "off"] | None
    """Estimate of the delay of the wrench clock, from the onsets of contacts. The program reports it, and
    applies it only on request. It has no keys. Off: no estimate."""

    markers: Markers | Literal[False, "off"] | None
    """Markers on the stylus, for recordings that hold them in place of its pose (--markers-topic): springs and
    dampers pull a rigid body to the visible markers. The default values are those of the simulated stylus."""

    scan_to_space: ScanToSpace | Literal[False, "off"] | None
    """Pose of the scan in the frame of the recorded poses: p_space = R p_scan + t (`touchup calibrate scan`).
    Not named: the poses are in the frame of the scan."""

    changes: list[Changes]
    """What changed its place while the recording lasted (`touchup doctor`), one after the other: taken off the
    poses. A change lasts until the end of the recording. Not named: nothing moved but the stylus."""

    compensation: Compensation | Literal[False, "off"] | None
    """Subtraction of weight and bias from the wrench (`touchup calibrate payload`). Not named: the driver of
    the sensor subtracts them, and the sensor has the axes of the tip."""

    bias_tracking: BiasTracking | Literal[False, "off"] | None
    """Tracking of the slow drift of the sensor in free air. Not named: the bias stays constant."""

    contact: Contact | Literal[False, "off"] | None
    """Contact gate: separates contact from free motion by the measured force. Off: every sample counts as
    contact."""

    tip: Tip | Literal[False, "off"] | None
    """Tip of the stylus: a ball, the flat end of a cylinder, or a cone with a round nose. The origin of the
    pose is the centre of the ball or nose, or the middle of the flat end; its z axis runs along the shaft, from
    the tip to the handle. Off: a rigid point."""

    scan: Scan | Literal[False, "off"] | None
    """Scan and its quality. Off: the scan is free of noise."""

    sliding: Sliding | Literal[False, "off"] | None
    """Removal of friction from the measured normal while the ball slides, in the haptic update and in the
    patch. Off: the direction of the force is the normal. The keys are for the haptic update, which knows only
    the past; of them the patch uses only the cone, as it looks ahead."""

    carve: Carve | Literal[False, "off"] | None
    """Carving and free space: the haptic update and the patch remove surface that the tip passes through
    without a force. Off: lids over holes stay. The keys are for carving, by the haptic update; in the patch
    free space counts as touches do."""

    guard: Guard | Literal[False, "off"] | None
    """Guard of the mesh: cuts back an update that would exceed one of these limits. Off: no limits, as in the
    paper, and the mesh of a noisy scan may diverge."""

    patch: Patch | Literal[False, "off"] | None
    """Reconstruction of the touched surface, finer than the scan: edges are sharp, closed holes open, and the
    untouched scan stays unchanged. Off: the triangles of the scan stay and only move."""

    uncertainty: Uncertainty | Literal[False, "off"] | None
    """Uncertainty of each vertex (sigma_mm in the PLY), and rejection of outliers: touches that contradict
    their place. A second pass that confirms an outlier relocates the place. Needs patch. Off: every touch
    counts, and the result has no uncertainty."""

    robot: Robot | Literal[False, "off"] | None
    """Arm with a probe (`touchup probe`, docs/probing.md). Not named: no probing. A request can ask for less
    than these limits, never for more. The tip must be a ball, and scan_to_space is the pose of the scan in the
    base of the arm."""

    refine: Refine | Literal[False, "off"] | None
    """Haptic update: moves the mesh until measured and expected force agree. Off: the mesh stays."""
