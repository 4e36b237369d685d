"""Mistakes of the poses: of the tracker, of its axes, unit and numbers; and gaps."""

from dataclasses import replace

import numpy as np

from .kind import DIAGONAL, WHOLE, Changed, add, evenly, lagged, since, three, wander, windows

STEP_S = 2e-3
MM = three(0.03, 0.1, 0.3)


def held(recording, size):
    """The tracker repeats its last pose, five times in the session."""
    order = recording.pose.in_order()
    number = windows(recording.facts["rng"], recording, 5, size)(recording.pose.time_s[order])
    at = np.arange(len(order))
    is_first = np.diff(number, prepend=-1) != 0
    last = np.maximum.accumulate(np.where((number < 0) | is_first, at, 0))
    values = recording.pose.values.copy()
    values[order] = values[order[last]]
    return Changed(recording.with_poses(values), f"the pose is held for {size} s, five times")


def dropped(recording, size, name):
    """Gaps in one of the streams."""
    number = windows(recording.facts["rng"], recording, 100, size * recording.facts["duration_s"] / 100)
    stream = getattr(recording, name)
    kept = replace(recording, **{name: stream.kept(number(stream.time_s) < 0)})
    return Changed(kept, f"{100 * size:.0f} % of the messages of each {name} are lost, in 100 gaps")


def low_passed(recording, size):
    order = recording.pose.in_order()
    values = recording.pose.values.copy()
    sorted_values = values[order]
    turned = np.sign((sorted_values[1:, 3:] * sorted_values[:-1, 3:]).sum(axis=1))
    sorted_values[1:, 3:] *= np.cumprod(turned)[:, None]
    smooth = lagged(sorted_values, size * 1e-3, STEP_S)
    smooth[:, 3:] /= np.linalg.norm(smooth[:, 3:], axis=1, keepdims=True)
    values[order] = smooth
    return Changed(recording.with_poses(values), f"low-pass of {size} ms on the pose")


def placed(recording, size, place, what):
    return Changed(recording.with_place(place(recording, recording.place_mm(), size)), what.format(size))


def wrong_order(recording, _):
    values = recording.pose.values[:, [0, 1, 2, 6, 3, 4, 5]]
    return Changed(recording.with_poses(values), "quaternions as w, x, y, z")


def wandering(of, place, size):
    order = of.pose.in_order()
    off = np.empty_like(place)
    off[order] = wander(of.facts["rng"], size, 2.0, STEP_S, place.shape)
    return place + off


def jumped_back(of, place, size):
    time_s = of.pose.time_s
    return place + np.outer(since(time_s, of, 1 / 3) - since(time_s, of, 2 / 3), size * DIAGONAL)


def swayed(of, place, size):
    return place + np.outer(np.sin(2 * np.pi * evenly(of.pose.time_s, of)), size * DIAGONAL)


def outlying(of, place, size):
    rng = of.facts["rng"]
    way = rng.normal(size=place.shape)
    is_out = rng.random(len(place)) < 0.01
    return place + is_out[:, None] * size * way / np.linalg.norm(way, axis=1, keepdims=True)


add("pose_held", three(0.3, 1.0, 3.0), held)
add("pose_low_passed", three(5.0, 15.0, 50.0), low_passed)
add("pose_rounded", MM, placed, lambda of, place, size: np.round(place / size) * size, "positions in steps of {} mm")
add("pose_scale", three(1.001, 1.003, 1.01), placed, lambda of, place, size: place * size, "positions too large by a factor of {}")
add("pose_axes_swapped", WHOLE, placed, lambda of, place, _: place[:, [1, 0, 2]], "x and y of the positions are swapped")
add("pose_axis_mirrored", WHOLE, placed, lambda of, place, _: place * [-1, 1, 1], "x of the positions is reversed")
add("pose_unit_mm", WHOLE, placed, lambda of, place, _: place * 1e3, "positions in mm instead of m")
add("pose_quaternion_wrong_order", WHOLE, wrong_order)
add("tracker_wander", MM, placed, wandering, "the tracker wanders by {} mm in 2 s")
add("tracker_jump_back", three(0.1, 0.3, 1.0), placed, jumped_back, "poses are off by {} mm in the middle third")
add("tracker_sway", three(0.1, 0.3, 1.0), placed, swayed, "poses swing by {} mm, once in the session")
add("tracker_outliers", three(1.0, 3.0, 10.0), placed, outlying, "1 % of the poses are off by {} mm")
for stream in ("pose", "wrench"):
    add(f"{stream}_dropped", three(0.03, 0.1, 0.3), dropped, stream)
