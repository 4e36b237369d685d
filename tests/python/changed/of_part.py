"""Mistakes of part, stylus, and told numbers: what is not where, or not as, the scene says."""

import numpy as np
from scipy.spatial.transform import Rotation

from .kind import AXES, DIAGONAL, WHOLE, Changed, add, evenly, numbers_of, since, three

MM = three(0.1, 0.3, 1.0)
DEGREES = three(0.1, 0.3, 1.0)
SKEW = np.array([1.0, 2.0, -1.0]) / np.sqrt(6)


def moved(recording, share, shift_mm, turn_deg):
    """Poses that follow a part which has moved by a share of a shift and of a turn about its middle."""
    middle = recording.facts["middle_mm"]
    turn = Rotation.from_rotvec(share[:, None] * np.radians(turn_deg))
    place = middle + share[:, None] * shift_mm + turn.apply(recording.place_mm() - middle)
    return recording.with_place(place).with_turns(turn * recording.turns())


def course(recording, at):
    """Share of a change at each pose, its true time, and that in words; `at`: share of the session, `None`: slowly over all of it."""
    time_s = recording.pose.time_s
    if at is None:
        return evenly(time_s, recording), {}, "slowly"
    return since(time_s, recording, at), {"at_s": at * recording.facts["duration_s"]}, f"at {100 * at:.0f} %"


def part(recording, size, along=(0, 0, 0), about=(0, 0, 0), at=0.5):
    share, number, when = course(recording, at)
    shift, turn = size * np.asarray(along), size * np.asarray(about)
    numbers = numbers_of("shift", shift, "mm") | numbers_of("turn", turn, "deg") | number
    what = f"{when} the part moves by {shift.round(3)} mm and turns by {turn.round(3)}° about its middle"
    return Changed(moved(recording, share, shift, turn), what, numbers)


def shifted_twice(recording, size):
    time_s = recording.pose.time_s
    first, second = size * DIAGONAL, size * np.array([1.0, -1.0, 0.0]) / np.sqrt(2)
    further = np.outer(since(time_s, recording, 1 / 3), first) + np.outer(since(time_s, recording, 2 / 3), second)
    what = f"the part moves by {first.round(3)} mm at 1/3, and by {second.round(3)} mm at 2/3"
    return Changed(recording.with_place(recording.place_mm() + further), what)


def bent(recording, size, along, at=0.5):
    """The ball is elsewhere on the stylus, whose recorded origin follows: - turn · shift."""
    share, number, when = course(recording, at)
    shift = size * np.asarray(along)
    place = recording.place_mm() - recording.turns().apply(share[:, None] * shift)
    what = f"{when} the ball moves by {shift.round(3)} mm on the stylus"
    return Changed(recording.with_place(place), what, numbers_of("bend", shift, "mm") | number)


def offset_told(recording, size, along):
    found = size * np.asarray(along)
    told = {"tip": {"offset_mm": (-found).tolist()}}
    return Changed(recording, f"the ball is {found.round(3)} mm from its told place on the stylus", numbers_of("offset", found, "mm"), told)


def radius_told(recording, size, sign):
    true = recording.facts["meta"]["ball_radius_mm"]
    told = {"tip": {"radius_mm": true + sign * size}}
    return Changed(recording, f"the radius is told as {true + sign * size:.2f} mm, it is {true} mm", {"radius_mm": true}, told)


def stiffness_told(recording, size, power):
    true = recording.facts["meta"]["tip_stiffness_N_per_mm"]
    told = {"tip": {"stiffness_n_per_mm": true * size**power}}
    return Changed(recording, f"the stiffness is told as {size**power:.3f} of what it is", {"compliance_mm_per_n": 1 / true}, told)


def stiffness_changed(recording, size):
    """A softer stylus sinks further under the same force, so its recorded origin goes deeper."""
    true = recording.facts["meta"]["tip_stiffness_N_per_mm"]
    further = since(recording.pose.time_s, recording, 0.5)[:, None] * (size - 1) / true
    place = recording.place_mm() - further * recording.force_of_part()
    number = {"compliance_more_mm_per_n": (size - 1) / true, "at_s": 0.5 * recording.facts["duration_s"]}
    return Changed(recording.with_place(place), f"at 50 % the stylus gets softer by a factor of {size}", number)


def scan_placed(recording, size, along=(0, 0, 0), about=(0, 0, 0)):
    middle = recording.facts["middle_mm"]
    turn = Rotation.from_rotvec(np.radians(size) * np.asarray(about))
    position = middle - turn.apply(middle) + size * np.asarray(along)
    told = {"scan_to_space": {"position_mm": position.tolist(), "orientation_xyzw": turn.as_quat().tolist()}}
    return Changed(recording, f"the scan's pose is told {size} mm or ° beside the right one", told=told)


for axis, along in AXES.items():
    add(f"part_shift_{axis}", MM, part, along=along)
    add(f"part_turn_{axis}", DEGREES, part, about=along)
add("part_shift_early", MM, part, along=DIAGONAL, at=0.3)
add("part_shift_late", MM, part, along=DIAGONAL, at=0.7)
add("part_moved", MM, part, along=DIAGONAL, about=SKEW)
add("part_moved_early", MM, part, along=DIAGONAL, about=SKEW, at=0.3)
add("part_turned_over", WHOLE, part, about=180 * AXES["x"])
add("part_drift_x", MM, part, along=AXES["x"], at=None)
add("part_drift_z", MM, part, along=AXES["z"], at=None)
add("part_drift_turn", DEGREES, part, about=SKEW, at=None)
add("part_shift_twice", MM, shifted_twice)
for axis, along in AXES.items():
    add(f"tip_bent_{axis}", MM, bent, along)
add("tip_bent_early", MM, bent, DIAGONAL, 0.3)
add("tip_bent_late", MM, bent, DIAGONAL, 0.7)
add("tip_bent_drift", MM, bent, np.array([1.0, 1.0, 0.0]) / np.sqrt(2), None)
for axis, along in AXES.items():
    add(f"tip_offset_{axis}", MM, offset_told, along)
add("radius_told_larger", three(0.05, 0.15, 0.5), radius_told, 1)
add("radius_told_smaller", three(0.05, 0.15, 0.5), radius_told, -1)
add("stiffness_told_higher", three(1.2, 2.0, 6.0), stiffness_told, 1)
add("stiffness_told_lower", three(1.2, 2.0, 6.0), stiffness_told, -1)
add("stiffness_changes_halfway", three(1.2, 2.0, 6.0), stiffness_changed)
add("scan_shifted_x", MM, scan_placed, along=AXES["x"])
add("scan_shifted_z", MM, scan_placed, along=AXES["z"])
add("scan_turned", DEGREES, scan_placed, about=SKEW)
add("scan_scaled", three(1.001, 1.003, 1.01), lambda of, size: Changed(of, f"the scan is too large by a factor of {size}", scan_scale=size))
