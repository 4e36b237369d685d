"""Scans and touches a part: writes scan.ply, touch.csv, scene.yaml as a calibration tells it, and the truth beside them."""

import json
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.csv
from scipy.spatial.transform import Rotation

from .contact import Stylus, Surface, hertz
from .hand import STEP_S, joined, stroked
from .instruments import ForceSensor, Tracker, turns_of
from .noise import ornstein_uhlenbeck
from .scanner import scanned
from .strokes import strokes_over

WORLD = "foreign"
# of the moduli of a ruby ball and of aluminium, N/mm²
MODULUS = 6.2e4
# contacts in the file of the truth, as a share of the steps
TRUTH_EVERY = 10


def drawn(rng):
    """A stylus, a tracker and a force sensor."""
    radius = rng.uniform(1.2, 2.2)
    kinetic = rng.uniform(0.1, 0.25)
    stylus = Stylus(radius, rng.uniform(15, 40), 0.004, hertz(radius, MODULUS), kinetic * rng.uniform(1.05, 1.3), kinetic, 4.0, 300.0)
    tip = np.array([*rng.uniform(-15, 15, 2), -rng.uniform(100, 150)])
    tracker = Tracker(
        rate_hz=rng.uniform(180, 340), jitter=0.15, delay_s=rng.uniform(0.002, 0.012), white_mm=0.02, wander_mm=rng.uniform(0.05, 0.1),
        wander_s=rng.uniform(1, 3), turn_rad=np.radians(0.01), turn_wander_rad=np.radians(0.01), outlier_share=0.001, lost_share=0.01, tip_mm=tip,
    )  # fmt: skip
    talk = np.eye(3) + rng.uniform(0.01, 0.02, (3, 3)) * rng.choice([-1, 1], (3, 3))
    sensor = ForceSensor(
        cutoff_hz=rng.uniform(60, 150), cross_talk=talk, bias_n=rng.normal(0, 0.5, 3), white_n=0.02, drift_n=0.02, drift_s=40.0,
        warming_n=rng.normal(0, 0.1, 3), warming_s=rng.uniform(100, 300), step_n=0.01,
    )  # fmt: skip
    return stylus, tracker, sensor


def simulate(mesh, folder, seed, sides):
    """Makes the folder of a part in this world; the part's frame is that of the scan."""
    rng = np.random.default_rng([seed, 61])
    stylus, tracker, sensor = drawn(rng)
    noise, voxel = rng.uniform(0.1, 0.25), rng.uniform(1.3, 2.0)
    surface = Surface(mesh)
    scan = scanned(surface, sides, noise, voxel, rng)
    scan.export(folder / "scan.ply")
    strokes = strokes_over(surface, sides, stylus.radius, rng)
    motion = joined(mesh, stylus.radius, strokes, stroked(surface, stylus, strokes, rng), rng)
    truth_of_contacts(folder, motion)
    space = Rotation.random(random_state=seed), rng.uniform(-500, 500, 3)
    told = told_of(space, stylus, tracker, sensor, mesh, rng)
    record(folder / "touch.csv", motion, space, tracker, sensor, rng)
    write_told(folder, space, told, (stylus, tracker, sensor), scan_noise(scan, surface) * rng.uniform(0.85, 1.15), seed)


def truth_of_contacts(folder, motion):
    at = np.flatnonzero(np.isfinite(motion.contact[:, 0]))
    at = at[at % TRUTH_EVERY == 0]
    table = np.column_stack([at * STEP_S, motion.centre[at], motion.contact[at]])
    names = ["t_s"] + [f"{what}_{axis}_mm" for what in ("centre", "contact") for axis in "xyz"]
    np.savetxt(folder / "truth_contacts.csv", table, fmt="%.4f", delimiter=",", header=",".join(names), comments="")


def record(path, motion, space, tracker, sensor, rng):
    """A table in order of stamps; each line has a pose or a force, in the axes of the stylus."""
    turn, shift = space
    held, force = turn.apply(motion.held) + shift, turn.apply(motion.force)
    spin = ornstein_uhlenbeck(rng, 0.4, 10.0, STEP_S, (len(held),))
    turns = turns_of(turn.apply(motion.axis), spin)
    pose_times, places, quaternions = tracker.frames(held, turns, rng)
    force_times, forces = sensor.readings(force, turns, rng)
    count, all_times = len(pose_times), np.concatenate([pose_times, force_times])
    order = np.argsort(all_times, kind="stable")
    values = np.full((len(order), 10), np.nan)
    values[:count, :3], values[:count, 3:7], values[count:, 7:] = places.round(4), quaternions.round(7), forces.round(4)
    names = ["x_mm", "y_mm", "z_mm", "qx", "qy", "qz", "qw", "fx_N", "fy_N", "fz_N"]
    columns = {"t_s": all_times[order].round(6)} | dict(zip(names, values[order].T))
    table = pa.table({name: pa.array(np.ascontiguousarray(column), from_pandas=True) for name, column in columns.items()})
    pyarrow.csv.write_csv(table, path, pyarrow.csv.WriteOptions(quoting_style="none"))


def told_of(space, stylus, tracker, sensor, mesh, rng):
    """Place of the scan, stylus, tracker and sensor as a calibration leaves them."""
    turn, shift = space
    # about the middle of the part, where the registration is best
    middle = mesh.bounds.mean(axis=0)
    told_turn = turn * Rotation.from_rotvec(rng.normal(0, 1e-4, 3))
    told_shift = turn.apply(middle) + shift - told_turn.apply(middle) + rng.normal(0, 0.02, 3)
    told_stylus = replace(stylus, radius=stylus.radius + rng.uniform(-0.005, 0.005), stiffness=stylus.stiffness * rng.uniform(0.97, 1.03))
    told_tip = tracker.tip_mm + rng.uniform(-0.03, 0.03, 3)
    told_tracker = replace(tracker, tip_mm=told_tip, delay_s=tracker.delay_s + rng.uniform(-0.001, 0.001))
    return (told_turn, told_shift), told_stylus, told_tracker, replace(sensor, bias_n=sensor.bias_n + rng.normal(0, 0.03, 3))


def scan_noise(scan, surface):
    """Root mean square of the scan's distances from the part, without its lids, mm."""
    distance = surface.nearest(scan.vertices)[0]
    return float(np.sqrt(np.mean(distance[distance < 1.0] ** 2)))


def listed(values):
    return "[" + ", ".join(f"{value:.9f}" for value in values) + "]"


def write_told(folder, space, told, drawn_ones, noise, seed):
    (turn, shift), stylus, tracker, sensor = told
    (folder / "scene.yaml").write_text(f"""\
# World {WORLD}, seed {seed}, as a calibration tells it; truth.json has the truth.
sync:
  wrench_offset_ms: {-1e3 * tracker.delay_s:.4f}
  largest_gap_ms: 30
clock:
columns:
  wrench_axes: tip
scan_to_space:
  position_mm: {listed(shift)}
  orientation_xyzw: {listed(turn.as_quat())}
compensation:
  bias:
    force_n: {listed(sensor.bias_n)}
    torque_nm: [0, 0, 0]
bias_tracking:
contact:
  on_n: 0.4
  off_n: 0.25
  free_n: 0.17
tip:
  offset_mm: {listed(tracker.tip_mm)}
  radius_mm: {stylus.radius:.5f}
  stiffness_n_per_mm: {stylus.stiffness:.4f}
scan:
  file: scan.ply
  unit: mm
  noise_mm: {noise:.4f}
sliding:
carve:
  tolerance_mm: 0.05
guard:
patch:
uncertainty:
  radius_sigma_mm: 0.003
  place_sigma_mm: 0.03
  stiffness_percent: 2
refine:
""")

    def pose(of):
        return {"orientation_xyzw": of[0].as_quat().tolist(), "position_m": (of[1] * 1e-3).tolist()}

    def numbers(of):
        return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in vars(of).items()}

    true_ones = {type(one).__name__.lower(): numbers(one) for one in drawn_ones}
    truth = {"seed": seed, "scan_to_space": {"truth": pose(space), "told": pose((turn, shift))}} | true_ones
    (folder / "truth.json").write_text(json.dumps(truth, indent=1))
