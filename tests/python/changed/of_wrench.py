"""Mistakes of the wrench: of its zero, scale, axes and unit, and of its clock."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from .kind import AXES, WHOLE, Changed, add, evenly, lagged, numbers_of, since, three

NEWTONS = three(0.1, 0.3, 1.0)
STEP_S = 1e-3
GAIN = three(1.1, 1.3, 2.0)
TALK = np.array([[0.0, 1.0, -0.7], [-0.5, 0.0, 1.0], [0.8, -1.0, 0.0]])
MS = three(10.0, 30.0, 100.0)


def tare(recording, size, along, drifts=False):
    bias = size * np.asarray(along)
    share = evenly(recording.wrench.time_s, recording) if drifts else np.ones(len(recording.wrench.time_s))
    numbers = {} if drifts else numbers_of("bias", bias, "n")
    what = f"the sensor reads {bias.round(3)} N too much" + (", slowly over the session" if drifts else "")
    return Changed(recording.with_force(recording.force_n() + np.outer(share, bias)), what, numbers)


def rezeroed(recording, size):
    """Zeroed in contact at the moment about half way that feels about this force."""
    force = lagged(recording.force_n(), 0.01, STEP_S)
    time_s, half_s = recording.wrench.time_s, recording.facts["duration_s"] / 2
    misfit = np.abs(np.linalg.norm(force, axis=1) / size - 1) + np.abs(time_s - half_s) / half_s
    at = np.argmin(misfit)
    zeroed = recording.force_n() - np.outer(time_s >= time_s[at], force[at])
    numbers = numbers_of("bias", -force[at], "n") | {"at_s": float(time_s[at])}
    return Changed(recording.with_force(zeroed), f"zeroed at {time_s[at]:.1f} s while it felt {force[at].round(2)} N", numbers)


def weighed(recording, size):
    """The weight of the stylus stays in the force; down is against the axis from which the part is worked."""
    weight = recording.turns_of_wrenches().inv().apply(-size * np.array(recording.facts["meta"]["work_axis"]))
    return Changed(recording.with_force(recording.force_n() + weight), f"a weight of {size} N is in the force", {"weight_n": size})


def mixed(recording, matrix, what, numbers=None):
    return Changed(recording.with_force(recording.force_n() @ np.asarray(matrix).T), what, numbers or {})


def sensor_turned(recording, size, axis):
    return mixed(recording, Rotation.from_euler(axis, size, True).as_matrix(), f"the sensor is turned by {size}° about {axis}")


def scaled(recording, size, what):
    true = recording.facts["meta"]["tip_stiffness_N_per_mm"]
    return mixed(recording, size * np.eye(3), f"{what}: the force is {size} of what it is", {"compliance_mm_per_n": 1 / (true * size)})


def read_as(recording, size, read, what):
    return Changed(recording.with_force(read(recording.force_n(), size)), f"{what} {size}")


def low_passed(recording, size):
    order = recording.wrench.in_order()
    force = recording.force_n().copy()
    force[order] = lagged(force[order], size * 1e-3, STEP_S)
    return Changed(recording.with_force(force), f"low-pass of {size} ms on the force")


def clock(recording, size, late_of, what, offset=None):
    """Stamps later by `late_of` the times, ms; `offset`: share of the size, of the true offset."""
    time_s, of_case = recording.wrench.time_s, recording.facts["meta"]["wrench_clock_offset_ms"]
    numbers = {} if offset is None else {"wrench_offset_ms": of_case + offset * size}
    late = replace(recording, wrench=replace(recording.wrench, time_s=time_s + 1e-3 * late_of(recording, time_s, size)))
    return Changed(late, f"wrench stamps {what}: {size} ms", numbers)


def clock_drifts(recording, size):
    changed = clock(recording, size, lambda of, time, size: size * evenly(time, of), "later and later")
    at_first, duration_s = recording.facts["meta"]["wrench_clock_offset_ms"], recording.facts["duration_s"]
    return replace(changed, numbers={"wrench_offset_at_first_ms": at_first, "wrench_drift_ppm": size * 1e3 / duration_s})


def clock_steps(recording, size):
    changed = clock(recording, size, lambda of, time, size: size * since(time, of, 0.5), "late from 50 % on")
    before, half_s = recording.facts["meta"]["wrench_clock_offset_ms"], recording.facts["duration_s"] / 2
    return replace(changed, numbers={"wrench_offset_before_ms": before, "wrench_offset_after_ms": before + size, "at_s": half_s})


def clock_jitters(recording, size):
    changed = clock(recording, size, lambda of, time, size: of.facts["rng"].normal(0, size, len(time)), "to and fro")
    return replace(changed, numbers={"stamp_jitter_ms": size})


add("tare_x", NEWTONS, tare, AXES["x"])
add("tare_z", NEWTONS, tare, AXES["z"])
add("tare_drift", NEWTONS, tare, np.array([0.6, 0.0, 0.8]), drifts=True)
add("rezeroed_in_contact_halfway", three(0.3, 1.0, 3.0), rezeroed)
add("weight_not_compensated", NEWTONS, weighed)
add("force_scale", GAIN, scaled, "gain")
add("force_scale_one_axis", GAIN, lambda of, size: mixed(of, np.diag([1, 1, size]), f"gain of {size} along z"))
add("force_crosstalk", three(0.03, 0.1, 0.3), lambda of, size: mixed(of, np.eye(3) + size * TALK, f"crosstalk of {size}"))
add("force_sensor_turned_x", three(5.0, 15.0, 45.0), sensor_turned, "x")
add("force_sensor_turned_z", three(5.0, 15.0, 45.0), sensor_turned, "z")
add("force_axis_mirrored", WHOLE, lambda of, _: mixed(of, np.diag([-1, 1, 1]), "the force along x is reversed"))
add("force_sign_flipped", WHOLE, lambda of, _: mixed(of, -np.eye(3), "the force is reversed"))
add("unit_lbf", WHOLE, lambda of, _: scaled(of, 0.224809, "lbf"))
add("unit_kgf", WHOLE, lambda of, _: scaled(of, 0.101972, "kgf"))
add("unit_ounce", WHOLE, lambda of, _: scaled(of, 3.596943, "ozf"))
add("force_rounded", NEWTONS, read_as, lambda force, size: np.round(force / size) * size, "the force in steps, N, of")
add("force_clipped", three(3.0, 2.0, 1.0), read_as, lambda force, size: np.clip(force, -size, size), "each force clipped, N, at")
add("force_low_passed", three(5.0, 15.0, 50.0), low_passed)
add("clock_delay", MS, clock, lambda of, time, size: size, "late", offset=1)
add("clock_ahead", MS, clock, lambda of, time, size: -size, "early", offset=-1)
add("clock_drift", MS, clock_drifts)
add("clock_step_halfway", three(6.0, 20.0, 60.0), clock_steps)
add("clock_jitter", three(3.0, 10.0, 30.0), clock_jitters)
