"""The keys of a scene as typed dictionaries; written by generate_scene_keys.py from the definition of the parameters."""

from __future__ import annotations

from typing import Literal, TypedDict


class Sync(TypedDict, total=False):
    """Pairs poses with wrenches: the pose is interpolated at the stamp of each wrench. Off: only messages of
    equal stamp pair."""

    reorder_ms: float
    """How far a message may lag behind the newest stamp of its stream; also how long a sample is held back. —
    [ms] 0 to 60000; default `20`"""

    largest_gap_ms: float
    """Largest distance between the two poses around a wrench; over a longer one a path would be invented. —
    [ms] 0 to 60000; default `30`"""

    largest_jump_s: float
    """A stamp this far ahead of its stream is accepted only when the next four agree; it costs only itself when
    they do not. — [s] 0 to 1e+06; default `0.1`"""

    wrench_offset_ms: float
    """What the clock of the wrench reads beyond the clock of the pose; taken off its stamps. — [ms] -60000 to
    60000; default `0`"""

    wrench_drift_ppm: float
    """What the clock of the wrench gains on the clock of the pose, from the first wrench on; taken off its
    stamps beside the offset. — [ppm] -1000 to 1000; default `0`"""

    capacity: float
    """How many messages of each stream are held. — [messages] 2 to 1e+06; default `4096`"""


class Columns(TypedDict, total=False):
    """The columns of a recording that is a table (CSV, or the log of a UR's RTDE): by their names in its first
    line, each with its unit, as in x_mm or `x [mm]`. Not named: the usual names are looked for, and those of
    RTDE."""

    time: str
    """The column of the time: s, ms, us or ns."""

    position: list[str]
    """Position of the tip, three columns: m, mm, um or inch."""

    orientation: list[str]
    """Its orientation: a quaternion x, y, z, w, or a rotation vector of three columns in rad or deg; left out
    and not found: none, which a ball needs none of when the wrench is in the axes of the positions."""

    force: list[str]
    """Force of the part on the stylus, three columns: N or kN."""

    torque: list[str]
    """Its torque: Nm or Nmm; left out and not found: 0."""

    wrench_axes: Literal["pose", "tip"]
    """In whose axes force and torque are: those of the positions, or those of the tip, which the orientation
    turns.; default `pose`"""


class Clock(TypedDict, total=False):
    """Estimates how late the clock of the wrench reads, from the moments at which contact begins; reported, and
    never applied unasked. It has no keys. Off: it is not estimated."""


class Markers(TypedDict, total=False):
    """The markers on the stylus, for recordings that hold them in place of its pose (--markers-topic): a rigid
    body is pulled to the markers that are seen by springs and dampers. The values are those of the simulated
    stylus."""

    positions_mm: list[list[float]]
    """Each marker from the centre of the ball, in the axes of the tip (z: along the shaft, tip to handle), by
    label from 0 on; 3 to 16, not on one line. — [mm] -10000 to 10000; default `[[28, 0, 120], [-20, 22, 128],
    [-16, -26, 140], [18, 24, 155], [-30, 2, 168], [6, -22, 180]]`"""

    noise_mm: float
    """Noise of a marker per axis. — [mm] 1e-06 to 1000; default `0.15`"""

    gate_mm: float
    """A marker farther than this from where it is expected is another one, or none; less than half of the
    smallest distance between two markers. — [mm] 1e-06 to 1000; default `4`"""

    coast_ms: float
    """How long the body flies on when its markers do not determine it; after that there is no pose. — [ms]
    0.001 to 10000; default `30`"""

    period_ms: float
    """Time between two poses. — [ms] 0.05 to 10000; default `1`"""

    reorder_ms: float
    """How far a frame may lag behind the newest one. — [ms] 0 to 60000; default `20`"""

    spring_hz: float
    """Natural frequency √(k/m) / 2π of the springs between the body and its markers: higher follows faster,
    lower smooths more. — [Hz] 0.001 to 1e+06; default `12`"""

    damping: float
    """Damping d / (2 √(k m)): 1 is the fastest that does not swing. — 0.5 to 100; default `1`"""


class ScanToSpace(TypedDict, total=False):
    """Where the scan lies in the frame of the recorded poses: p_space = R p_scan + t (`touchup calibrate
    scan`). Not named: the poses are in the frame of the scan."""

    position_mm: list[float]
    """Origin of the scan in the frame of the poses. — [mm] -1e+06 to 1e+06; default `[0, 0, 0]`"""

    orientation_xyzw: list[float]
    """Orientation of the scan's axes in that frame, as a quaternion x, y, z, w. — [(length of the quaternion)]
    0.999 to 1.001; default `[0, 0, 0, 1]`"""


class CompensationPayload(TypedDict, total=False):
    """What hangs on the sensor."""

    gravity_axes: Literal["object", "space"]
    """In whose axes gravity is: the scan's own, or those of the recorded poses, which scan_to_space turns.;
    default `object`"""

    mass_kg: float
    """Its mass. — [kg] 0 to 1000; default `0`"""

    centre_mm: list[float]
    """Its centre of mass from the origin of the sensor, in its axes. — [mm] -10000 to 10000; default `[0, 0,
    0]`"""

    gravity_m_per_s2: list[float]
    """Acceleration of gravity. — [m/s²] -100 to 100; default `[0, 0, -9.81]`"""


class CompensationBias(TypedDict, total=False):
    """What the sensor reads when nothing touches and nothing hangs on it."""

    force_n: list[float]
    """The force, in the axes of the sensor. — [N] -10000 to 10000; default `[0, 0, 0]`"""

    torque_nm: list[float]
    """The torque, in the axes of the sensor. — [N·m] -10000 to 10000; default `[0, 0, 0]`"""


class Compensation(TypedDict, total=False):
    """Takes weight and bias off the wrench (`touchup calibrate payload`). Not named: the sensor has the axes of
    the tip and its driver does it."""

    payload: CompensationPayload | Literal[False, "off"] | None
    """What hangs on the sensor."""

    bias: CompensationBias | Literal[False, "off"] | None
    """What the sensor reads when nothing touches and nothing hangs on it."""

    sensor_position_mm: list[float]
    """Origin of the sensor from the centre of the ball, in the axes of the tip (z: along the shaft, tip to
    handle). — [mm] -100000 to 100000; default `[0, 0, 0]`"""

    sensor_orientation_xyzw: list[float]
    """Orientation of the sensor in the frame of the tip, as a quaternion x, y, z, w; left out: the same axes. —
    [(length of the quaternion)] 0.999 to 1.001"""


class BiasTracking(TypedDict, total=False):
    """Follows the slow drift of the sensor while nothing is touched. Not named: the bias stays as it is
    named."""

    settle_ms: float
    """It is free air once the motion has been free for this time (contact.free_n); what was learnt in this time
    before a contact is dropped. — [ms] 0.001 to 60000; default `60`"""

    time_s: float
    """Time constant of the running mean. — [s] 1e-06 to 1e+06; default `0.3`"""


class Contact(TypedDict, total=False):
    """Separates contact from free motion by the measured force. Off: every sample counts as contact."""

    on_n: float
    """A force above this begins a contact; no less than off_n. — [N] 0 to 1000; default `0.4`"""

    off_n: float
    """A force below this ends it. — [N] 0 to 1000; default `0.22`"""

    free_n: float
    """Below on_n, what the zero of the sensor may be off by: a force above this that its noise does not explain
    may be a light touch, which neither moves the mesh nor frees space. — [N] 0 to 1000; default `0.15`"""


class Tip(TypedDict, total=False):
    """The tip that touches: a ball, the flat end of a cylinder, or a cone with a round nose. The origin of the
    pose is the centre of the ball or nose, or the middle of the flat end; its z runs along the shaft, from the
    tip to the handle. Off: a rigid point."""

    shape: Literal["ball", "flat", "cone"]
    """Shape of the tip.; default `ball`"""

    offset_mm: list[float]
    """Centre of the ball from the origin of the recorded pose, in its axes (`touchup calibrate tip`); left out:
    it is that origin. The positions of markers are from that origin too. — [mm] -10000 to 10000"""

    radius_mm: float
    """Radius of the ball, of the flat end, or of the nose of the cone. — [mm] 0 to 1000; default `1.5`"""

    stiffness_n_per_mm: float
    """Stiffness of stylus and holder at the ball; left out: rigid. — [N/mm] 0.001 to 1e+09; default `20`"""

    edge_radius_mm: float
    """Flat: radius of the rounded edge, no more than radius_mm; left out: sharp. — [mm] 0 to 1000"""

    half_angle_deg: float
    """Cone: the angle between axis and flank. — [degrees] 1 to 80"""

    length_mm: float
    """Flat and cone: how far from the origin the tip is known to reach, more than edge_radius_mm; left out: two
    diameters, no less than 5 mm. — [mm] 0.001 to 1000"""


class Scan(TypedDict, total=False):
    """The scan, and how good it is. Off: it counts as free of noise."""

    file: str
    """The scan itself, where none is named otherwise: PLY, STL or OBJ, or a point cloud (PLY, PCD, XYZ or E57),
    relative to the folder of this scene."""

    unit: Literal["m", "mm", "inch"]
    """Unit of the coordinates in that file.; default `mm`"""

    region_low_mm: list[float]
    """Lowest corner of the box that the centre of the ball is in whenever it touches, in the frame of the scan:
    only what is near it gets adjacency and a tree, the rest of the scan is kept as it is and written with the
    result; touches elsewhere are refused. Not with an arm, and the node shows the part near the box alone. Name
    both corners; left out: anywhere. — [mm] -1e+06 to 1e+06"""

    region_high_mm: list[float]
    """Highest corner of that box. — [mm] -1e+06 to 1e+06"""

    noise_mm: float
    """Standard deviation of the scan from the true surface. — [mm] 0 to 1000; default `0.6`"""


class Sliding(TypedDict, total=False):
    """Takes friction out of the measured normal while the ball slides, in the haptic update and in the patch.
    Off: the force is the normal. All but the cone is for the haptic update, which knows the past alone; the
    patch looks ahead and finds its own."""

    smoothing_ms: float
    """Time constant of the filter on position and force. — [ms] 0 to 10000; default `6`"""

    velocity_smoothing_ms: float
    """Time constant of the velocity. — [ms] 0 to 10000; default `20`"""

    slowest_mm_per_s: float
    """Uncertainty of the velocity: slower than this the sliding direction hardly determines the normal. —
    [mm/s] 0 to 1e+06; default `8`"""

    cone_cosine: float
    """Cosine of the widest friction cone accepted; 0.9135 is 24 degrees, friction 0.45. — 0 to 1; default
    `0.9135`"""


class Carve(TypedDict, total=False):
    """Free space: what the tip passes through without a force is not there, in the haptic update and in the
    patch. Off: lids over holes stay. The keys are for the haptic update; in the patch free space counts as
    touches do."""

    rate_per_s: float
    """Share of the depth that goes in a second. — [1/s] 0 to 1e+06; default `300`"""

    tolerance_mm: float
    """Depth that is left alone: the noise of the tracking. — [mm] 0 to 1000; default `0.05`"""

    contact_tolerance_mm: float
    """While in contact only what is deeper than this is taken away: what is shallower may be the measured
    surface itself. — [mm] 0 to 1000; default `0.2`"""


class Guard(TypedDict, total=False):
    """Keeps the mesh sound: an update that would break one of these limits is cut back. Off: anything goes, as
    in the paper, and a noisy scan may blow up."""

    smallest_quality: float
    """Smallest twice area over longest edge squared: 0.15 is a triangle stretched sixfold; of a triangle that
    was scanned thin nine tenths of what it had. — 0 to 0.87; default `0.15`"""

    smallest_turn_cosine: float
    """Smallest cosine between normals before and after one update. — -1 to 1; default `0.5`"""

    smallest_evidence_cosine: float
    """Smallest cosine between a normal and the last that was scanned or measured there. — -1 to 1; default
    `0`"""

    smallest_fold_cosine: float
    """Smallest cosine between neighbours: -0.85 is 148 degrees apart. — -1 to 1; default `-0.85`"""

    gap_edges: float
    """Faces nearer than this many mean edges count as touching. — [mean edges] 0 to 1; default `0.01`"""


class Patch(TypedDict, total=False):
    """Reconstructs the surface where it was touched, finer than the scan: edges are sharp, closed holes open,
    and what was not touched stays as it was. Off: the triangles of the scan stay and are only moved."""

    tolerance_mm: float
    """How far the new faces may be from the surface that the touches show, on planes and down to holes twice as
    wide as the tip: a smaller one makes finer faces at edges and in holes, and takes longer. Left out: 1/64 of
    the radius of the tip. — [mm] 1e-06 to 100"""


class Uncertainty(TypedDict, total=False):
    """Reports how well each vertex is known (sigma_mm in the PLY), and rejects touches that contradict their
    place as outliers. A second pass that confirms the contradiction moves the place. Needs patch. Off: every
    touch counts, and nothing is reported."""

    gate_sigmas: float
    """A contact that contradicts by more than this many standard deviations is rejected as an outlier. —
    [standard deviations] 0.5 to 1e+06; default `4`"""

    radius_sigma_mm: float
    """What is left after calibrating the radius of the tip; it averages out in no number of touches, and twice
    of it is in each diameter and width. — [mm] 0 to 1000; default `0.001`"""

    place_sigma_mm: float
    """What is left after calibrating the centre of the tip and the frame of the scan, along each axis; it
    averages out in no number of touches, and is in each place and in no size. — [mm] 0 to 1000; default
    `0.002`"""

    stiffness_percent: float
    """What is left after calibrating the stiffness of the tip. — [%] 0 to 100; default `2`"""


class RobotRos2Control(TypedDict, total=False):
    """Topics and sensor of an arm behind ros2_control (docs/ros2_control.md)."""

    joint_states_topic: str
    """Topic of joint_state_broadcaster.; default `/joint_states`"""

    wrench_topic: str
    """Topic of force_torque_sensor_broadcaster.; default `/force_torque_sensor_broadcaster/wrench`"""

    trajectory_topic: str
    """Topic on which joint_trajectory_controller takes orders.; default
    `/joint_trajectory_controller/joint_trajectory`"""

    wrench_frame: str
    """The frame that its wrenches name.; default `tool0`"""

    sensor_position_mm: list[float]
    """Origin of that frame in the flange. — [mm] -1000 to 1000; default `[0, 0, 0]`"""

    sensor_orientation_xyzw: list[float]
    """Axes of that frame in the flange, as a quaternion x, y, z, w. — [(length of the quaternion)] 0.999 to
    1.001; default `[0, 0, 0, 1]`"""


class Robot(TypedDict, total=False):
    """The arm that holds a probe (`touchup probe`, docs/probing.md). Not named: nothing is probed. A request
    can ask for less than these limits, never for more. It needs a ball for a tip, and scan_to_space says where
    the scan lies in its base."""

    model: Literal["ur3e", "ur5e", "ur10e", "ur16e", "urdf"]
    """Model of the arm.; default `ur5e`"""

    urdf: str
    """With model: urdf, the description of the arm, its macros expanded, relative to the folder of this
    scene."""

    base_link: str
    """The link of the URDF whose frame is the base of the arm.; default `base_link`"""

    flange_link: str
    """The link of the URDF whose frame is the flange.; default `tool0`"""

    link_radius_mm: float
    """How thick links are that the URDF gives no simple shape: the radius of a capsule from joint to joint. —
    [mm] 1 to 1000; default `60`"""

    check: str
    """The record that `touchup check --out` wrote, relative to the folder of this scene; what it found is in
    each ±."""

    check_days: float
    """For how long a check counts: an older one stands in each result. — [days] 0.01 to 3650; default `30`"""

    temperature_c: float
    """Temperature of the cell: where a check was made at one that differs by more than 5 K, that stands in each
    result. — [°C] -50 to 100"""

    allow_motion: bool
    """Whether it may move at all; without it plans can be made and drawn.; default `false`"""

    host: str
    """Name or address of its controller; a simulated arm has none.; default ``"""

    site_packages: str
    """The folder that `touchup ur setup` prints (docs/ur.md); a simulated arm has none.; default ``"""

    ros2_control: RobotRos2Control | Literal[False, "off"] | None
    """Topics and sensor of an arm behind ros2_control (docs/ros2_control.md)."""

    payload_kg: float
    """Mass of all that hangs on the flange (`touchup calibrate payload --robot`). — [kg] 0 to 50; default
    `0.25`"""

    payload_centre_mm: list[float]
    """Its centre of mass in the flange. — [mm] -1000 to 1000; default `[0, 0, 50]`"""

    tip_position_mm: list[float]
    """Centre of the ball in the flange. — [mm] -2000 to 2000; default `[0, 0, 150]`"""

    tip_orientation_xyzw: list[float]
    """Axes of the tip in the flange (z: along the shaft, tip to handle), as a quaternion x, y, z, w. — [(length
    of the quaternion)] 0.999 to 1.001; default `[1, 0, 0, 0]`"""

    tolerance_mm: float
    """The numbers of a feature are to be known within ± this, with the probability `confidence`. — [mm] 0.0001
    to 10; default `0.05`"""

    confidence: float
    """Probability with which they are within the tolerance. — 0.5 to 0.9999; default `0.95`"""

    workspace_low_mm: list[float]
    """Smallest corner of the box that the centre of the ball stays in, in the base of the arm; with the default
    the arm can be nowhere. — [mm] -5000 to 5000; default `[0, 0, 0]`"""

    workspace_high_mm: list[float]
    """Largest corner of it, no less than workspace_low_mm. — [mm] -5000 to 5000; default `[0, 0, 0]`"""

    arm_low_mm: list[float]
    """Smallest corner of the box that all of the arm but its base stays in, in the base of the arm: the table,
    walls; left out: nothing is known of them. — [mm] -5000 to 5000"""

    arm_high_mm: list[float]
    """Largest corner of it. — [mm] -5000 to 5000"""

    largest_force_n: float
    """Force at the tip at which everything stops; well below that of the arm's own safety system. — [N] 0.1 to
    100; default `15`"""

    largest_mm_per_s: float
    """No motion of the tip is faster. — [mm/s] 0.1 to 250; default `100`"""

    largest_joint_deg_per_s: float
    """No joint turns faster: it does near a pose where the arm is nearly stuck. — [degrees/s] 1 to 360; default
    `90`"""

    acceleration_mm_per_s2: float
    """Acceleration of all motions. — [mm/s²] 10 to 5000; default `500`"""

    fault_stop_mm_per_s2: float
    """Deceleration of a stop at a fault or at an unexpected contact. The largest speed of every motion follows
    from it and from tip.stiffness_n_per_mm, so that the force at such a contact stays below largest_force_n. —
    [mm/s²] 10 to 10000; default `5000`"""

    largest_tare_n: float
    """Force at rest, before zeroing, above which the sensor is not zeroed: the tip would touch something. — [N]
    0.1 to 100; default `5`"""

    search_mm: float
    """Travel of one search at most. — [mm] 0.5 to 100; default `15`"""

    time_s: float
    """Time of one feature at most. — [s] 1 to 86400; default `600`"""

    least_dexterity: float
    """How far the arm stays from singular poses: smallest singular value of its Jacobian, lengths over its
    reach. — 0 to 1; default `0.02`"""

    touch_force_n: float
    """Force that a touch presses with, no more than largest_force_n. — [N] 0.1 to 100; default `3`"""

    trigger_n: float
    """Force at which a search stops: several deviations of its noise, no more than 0.8 of touch_force_n. — [N]
    0.05 to 80; default `1`"""

    link_mm_per_s: float
    """Speed through free air. — [mm/s] 0.1 to 250; default `50`"""

    search_mm_per_s: float
    """Speed while searching; slower where tip.stiffness_n_per_mm asks for it. — [mm/s] 0.1 to 250; default
    `10`"""

    measure_mm_per_s: float
    """Speed while measuring. — [mm/s] 0.05 to 250; default `2`"""

    slide_mm_per_s: float
    """Speed while the ball slides over what was found, at most. — [mm/s] 0.1 to 250; default `10`"""

    latency_ms: float
    """Time from a contact to the beginning of braking. — [ms] 0 to 200; default `20`"""

    force_noise_n: float
    """Standard deviation of the measured force. — [N] 0.0001 to 10; default `0.15`"""

    clearance_mm: float
    """Distance of the ball from the surface where a search begins. — [mm] 0.5 to 50; default `3`"""

    depth_mm: float
    """How deep the centre of the ball is let into a hole. — [mm] 0 to 100; default `5`"""

    touches: float
    """Touches of a feature at most. — [touches] 1 to 10000; default `39`"""

    touch_sigma_mm: float
    """Standard deviation of one touch beside that of its own curve: the repeatability of arm and probe
    (`touchup check`). — [mm] 1e-05 to 1; default `0.03`"""

    square_sigma_deg: float
    """Standard uncertainty with which the walls of holes, slots and bosses are perpendicular to the surface
    around them, in each of two directions, unless their touches say otherwise. — [degrees] 0.001 to 20; default
    `0.13`"""

    radius_sigma_mm: float
    """Standard uncertainty of the radius of the ball: twice of it is in each diameter, width and length, once
    in the place of a plane. — [mm] 0 to 10; default `0.001`"""

    place_sigma_mm: float
    """Standard uncertainty of where the scan lies in the base (scan_to_space), along each axis; 0: places are
    those of the scan as the scene puts it. — [mm] 0 to 100; default `0`"""

    turn_sigma_deg: float
    """… of how it is turned, about each axis; it counts with the distance from registered_at_mm. — [degrees] 0
    to 20; default `0`"""

    growth_mm_per_m: float
    """By how much places are less certain with each metre from registered_at_mm: the kinematics of the arm,
    joints and lengths. — [mm/m] 0 to 100; default `0`"""

    registered_at_mm: list[float]
    """Where the place of the scan is known best, in the frame of the scan: the middle of the features or
    spheres that it was found by. — [mm] -1e+06 to 1e+06; default `[0, 0, 0]`"""

    shaft_radius_mm: float
    """Radius of the shaft behind the ball. — [mm] 0.05 to 50; default `1`"""

    shaft_length_mm: float
    """How much of the shaft, and of the hand behind it, must keep clear of the mesh. — [mm] 0 to 500; default
    `60`"""

    margin_mm: float
    """What the scan may be wrong by, in moves through free air. — [mm] 0 to 50; default `0.5`"""


class Refine(TypedDict, total=False):
    """Moves the mesh until measured and expected force agree. Off: nothing moves it."""

    mode: Literal["robust", "paper"]
    """Which rule moves the mesh; paper: the published one taken literally, without contact, sliding, carve,
    guard and patch whatever is named.; default `robust`"""

    contact_model: Literal["sigmoid", "spring"]
    """Expected force over depth: the sigmoid of Eq 3, or the spring of the tip; left out: the spring where its
    stiffness is known."""

    alpha_m_per_n_s: float
    """Speed of a face for each newton of mismatch (Eq 6); left out: as the mode has it. — [m/(N·s)] 0 to
    1e+06"""

    beta_per_n2_s: float
    """Turning speed of a face for each square newton of mismatch (Eq 7); left out: as the mode has it. —
    [1/(N²·s)] 0 to 1e+09"""

    turning_per_s: float
    """Robust: rate at which a face turns to the measured normal, whatever the force; takes the place of beta. —
    [1/s] 0 to 1e+06"""

    step: Literal["lie", "corrected", "bounded", "dp5"]
    """How position and normal are put together: one after the other (lie), with a correction (corrected),
    solved together to 1e-9 (bounded, as with mode paper), or by adaptive Runge–Kutta (dp5)."""

    along: Literal["normal0", "force"]
    """In which direction a face moves: along the normal at the start of the sample (Eq 6), or along the
    force."""

    roi_mm: float
    """Vertices within this distance of the touched face follow it; left out: the radius of the ball. — [mm] 0
    to 1000"""

    f_max_n: float
    """Largest force of the sigmoid. — [N] 1e-06 to 1e+06; default `10`"""

    h_min_mm: float
    """Width of the sigmoid. — [mm] 1e-09 to 1e+06; default `0.5`"""

    delta: float
    """Shift of the sigmoid. — -50 to 50; default `5`"""


class Scene(TypedDict, total=False):
    """What differs from the usual cell; a part that is False or "off" is not built."""

    sync: Sync | Literal[False, "off"] | None
    """Pairs poses with wrenches: the pose is interpolated at the stamp of each wrench. Off: only messages of
    equal stamp pair."""

    columns: Columns | Literal[False, "off"] | None
    """The columns of a recording that is a table (CSV, or the log of a UR's RTDE): by their names in its first
    line, each with its unit, as in x_mm or `x [mm]`. Not named: the usual names are looked for, and those of
    RTDE."""

    clock: Clock | Literal[False, "off"] | None
    """Estimates how late the clock of the wrench reads, from the moments at which contact begins; reported, and
    never applied unasked. It has no keys. Off: it is not estimated."""

    markers: Markers | Literal[False, "off"] | None
    """The markers on the stylus, for recordings that hold them in place of its pose (--markers-topic): a rigid
    body is pulled to the markers that are seen by springs and dampers. The values are those of the simulated
    stylus."""

    scan_to_space: ScanToSpace | Literal[False, "off"] | None
    """Where the scan lies in the frame of the recorded poses: p_space = R p_scan + t (`touchup calibrate
    scan`). Not named: the poses are in the frame of the scan."""

    compensation: Compensation | Literal[False, "off"] | None
    """Takes weight and bias off the wrench (`touchup calibrate payload`). Not named: the sensor has the axes of
    the tip and its driver does it."""

    bias_tracking: BiasTracking | Literal[False, "off"] | None
    """Follows the slow drift of the sensor while nothing is touched. Not named: the bias stays as it is
    named."""

    contact: Contact | Literal[False, "off"] | None
    """Separates contact from free motion by the measured force. Off: every sample counts as contact."""

    tip: Tip | Literal[False, "off"] | None
    """The tip that touches: a ball, the flat end of a cylinder, or a cone with a round nose. The origin of the
    pose is the centre of the ball or nose, or the middle of the flat end; its z runs along the shaft, from the
    tip to the handle. Off: a rigid point."""

    scan: Scan | Literal[False, "off"] | None
    """The scan, and how good it is. Off: it counts as free of noise."""

    sliding: Sliding | Literal[False, "off"] | None
    """Takes friction out of the measured normal while the ball slides, in the haptic update and in the patch.
    Off: the force is the normal. All but the cone is for the haptic update, which knows the past alone; the
    patch looks ahead and finds its own."""

    carve: Carve | Literal[False, "off"] | None
    """Free space: what the tip passes through without a force is not there, in the haptic update and in the
    patch. Off: lids over holes stay. The keys are for the haptic update; in the patch free space counts as
    touches do."""

    guard: Guard | Literal[False, "off"] | None
    """Keeps the mesh sound: an update that would break one of these limits is cut back. Off: anything goes, as
    in the paper, and a noisy scan may blow up."""

    patch: Patch | Literal[False, "off"] | None
    """Reconstructs the surface where it was touched, finer than the scan: edges are sharp, closed holes open,
    and what was not touched stays as it was. Off: the triangles of the scan stay and are only moved."""

    uncertainty: Uncertainty | Literal[False, "off"] | None
    """Reports how well each vertex is known (sigma_mm in the PLY), and rejects touches that contradict their
    place as outliers. A second pass that confirms the contradiction moves the place. Needs patch. Off: every
    touch counts, and nothing is reported."""

    robot: Robot | Literal[False, "off"] | None
    """The arm that holds a probe (`touchup probe`, docs/probing.md). Not named: nothing is probed. A request
    can ask for less than these limits, never for more. It needs a ball for a tip, and scan_to_space says where
    the scan lies in its base."""

    refine: Refine | Literal[False, "off"] | None
    """Moves the mesh until measured and expected force agree. Off: nothing moves it."""
