"""The hand that pulls the stylus along strokes: a mass on spring and damper with tremor, in contact with the part; N, mm, s."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from .contact import Friction
from .noise import band, min_jerk, ornstein_uhlenbeck
from .strokes import AXES, safe_plane, way_between

STEP_S = 0.001
# 0.25 kg
MASS = 2.5e-4
SPRING = 0.8
DAMPING = 0.02
LIFT_MM_PER_S = 130.0
# the hand slows down before it expects the part
SLOW_MM_PER_S, SLOW_MM = 25.0, 2.5
# largest pull of its spring
STRENGTH_N = 5.0
# a hand that lags presses less, so that it comes around an edge
PRESSING_LAG_MM = 2.5
# a stroke that ends farther from the plane of its side is caught in the part
CAUGHT_MM = 3.0
FLIGHT_MM_PER_S = 250.0
DWELL_S = 0.06
SMOOTH_S = 0.03
TREMOR_MM, WANDER_MM = 0.12, 0.3


@dataclass
class Motion:
    """One time line: undeflected ball, ball, contact (nan: none), force of the part on the stylus, and axis of the shaft."""

    held: np.ndarray
    centre: np.ndarray
    contact: np.ndarray
    force: np.ndarray
    axis: np.ndarray


def planned(stroke, mesh, radius, rng):
    """Course of the hand over a stroke, with its pressing force: down from the plane of the side, along, up again."""
    side = AXES[stroke.side]

    def above(place):
        return place + stroke.axis * ((safe_plane(mesh, stroke.side, radius) - place @ side) / (stroke.axis @ side))

    first, last = stroke.centres[0], stroke.centres[-1]
    pace, press = rng.uniform(15, 40), rng.uniform(1.5, 4.0)
    near = first + SLOW_MM * stroke.axis
    corners = [above(first), above(first), near, first, *stroke.centres, last, above(last), above(last)]
    lengths = np.linalg.norm(np.diff(stroke.centres, axis=0), axis=1)
    down, up = (np.linalg.norm(above(place) - place) / LIFT_MM_PER_S for place in (near, last))
    times = np.concatenate([[0, DWELL_S, down, SLOW_MM / SLOW_MM_PER_S, DWELL_S], lengths / pace, [DWELL_S, up, DWELL_S]]).cumsum()
    clock = np.arange(0, times[-1], STEP_S)
    normals = np.vstack([[stroke.normals[0]] * 4, stroke.normals, [stroke.normals[-1]] * 3])
    pressing = np.concatenate([[0, 0, 0, 0], np.full(len(stroke.centres), press), [0, 0, 0]])

    def over(values):
        return np.stack([np.interp(clock, times, column) for column in np.asarray(values).T], axis=1)

    push = -over(normals) * np.interp(clock, times, pressing)[:, None]
    return gaussian_filter1d(over(corners), SMOOTH_S / STEP_S, axis=0, mode="nearest"), gaussian_filter1d(push, SMOOTH_S / STEP_S, axis=0)


def stroked(surface, stylus, strokes, rng):
    """The motion of each stroke; all are stepped at once."""
    plans = [planned(stroke, surface.mesh, stylus.radius, rng) for stroke in strokes]
    counts = np.array([len(course) for course, _ in plans])
    # the longest first, so that those still in motion are the first ones
    order = np.argsort(-counts)
    shape = (counts.max(), len(plans), 3)
    course, push = np.zeros(shape), np.zeros(shape)
    for k, at in enumerate(order):
        course[: counts[at], k], push[: counts[at], k] = plans[at]
        course[counts[at] :, k] = plans[at][0][-1]
    course += band(rng, 7, 12, TREMOR_MM, STEP_S, shape) + ornstein_uhlenbeck(rng, WANDER_MM, 1.0, STEP_S, shape)
    push *= 1 + ornstein_uhlenbeck(rng, 0.2, 0.4, STEP_S, (*shape[:2], 1))
    held, centre, contact, force = stepped(surface, stylus, course, push, counts[order])
    made = [None] * len(plans)
    for k, at in enumerate(order):
        steps = slice(counts[at])
        axis = np.tile(strokes[at].axis, (counts[at], 1))
        made[at] = Motion(held[steps, k], centre[steps, k], contact[steps, k], force[steps, k], axis)
    return made


def stepped(surface, stylus, course, push, counts):
    """Undeflected balls, balls, contacts and forces under the pull along a course; ball k moves for counts[k] steps, which fall."""
    held, centre, force = course.copy(), course.copy(), np.zeros_like(course)
    contact = np.full_like(course, np.nan)
    place, velocity = course[0].copy(), np.zeros_like(course[0])
    friction = Friction.at_rest(course.shape[1])
    for at in range(len(course)):
        live = int(np.searchsorted(-counts, -at))
        place, velocity = place[:live], velocity[:live]
        friction = Friction(friction.bristle[:live], friction.bend[:live], friction.slip[:live])
        felt, ball, point = felt_force(surface, stylus, place, velocity, friction)
        held[at, :live], centre[at, :live], contact[at, :live], force[at, :live] = place, ball, point, felt
        lag = course[at, :live] - place
        far = np.linalg.norm(lag, axis=1)
        pull = lag * np.minimum(SPRING, STRENGTH_N / np.maximum(far, 1e-9))[:, None]
        press = push[at, :live] * np.exp(-((far / PRESSING_LAG_MM) ** 2))[:, None]
        speed = (course[at, :live] - course[max(at - 1, 0), :live]) / STEP_S
        velocity = velocity + (pull + DAMPING * (speed - velocity) + press + felt) / MASS * STEP_S
        place = place + velocity * STEP_S
    return held, centre, contact, force


def felt_force(surface, stylus, place, velocity, friction):
    """Force of the part on each stylus, place of each ball, and the contact that presses most (nan: none)."""
    bent = place - friction.bend
    distances, points = surface.contacts(bent, stylus.radius)
    forces, normals = stylus.normal_forces(bent, distances, points)
    pressing = forces.sum(axis=1)
    total = (forces[..., None] * normals).sum(axis=1)
    size = np.linalg.norm(total, axis=1, keepdims=True)
    normal = total / np.where(size > 0, size, 1.0)
    rub = stylus.friction_step(friction, velocity, normal, pressing, STEP_S)
    # the loss of the shaft along the normal, which only a contact feels
    rub -= stylus.loss * normal * (velocity * normal).sum(axis=1, keepdims=True)
    most = points[np.arange(len(place)), forces.argmax(axis=1)]
    return total + rub, bent + total / stylus.stiffness, np.where(pressing[:, None] > 0, most, np.nan)


def is_back(mesh, radius, stroke, motion):
    """Whether a stroke ends on the plane of its side."""
    return abs(motion.held[-1] @ AXES[stroke.side] - safe_plane(mesh, stroke.side, radius)) < CAUGHT_MM


def joined(mesh, radius, strokes, motions, rng):
    """All strokes on one time line, but for those that are caught, with flights between them through free space."""
    kept = [at for at, motion in enumerate(motions) if is_back(mesh, radius, strokes[at], motion)]
    strokes, motions = [strokes[at] for at in kept], [motions[at] for at in kept]
    pieces = []
    for at, motion in enumerate(motions):
        if at:
            pieces.append(flight(mesh, radius, strokes[at - 1], pieces[-1], strokes[at], motion))
        pieces.append(motion)
    of = {name: np.concatenate([getattr(piece, name) for piece in pieces]) for name in ("held", "centre", "contact", "force", "axis")}
    wander = ornstein_uhlenbeck(rng, np.radians(1.0), 2.0, STEP_S, of["axis"].shape)
    of["axis"] = of["axis"] + wander
    of["axis"] /= np.linalg.norm(of["axis"], axis=1, keepdims=True)
    return Motion(**of)


def flight(mesh, radius, before, last, after, following):
    corners = way_between(mesh, before.side, last.held[-1], after.side, following.held[0], radius)
    places = [
        start + (end - start) * min_jerk(max(60, int(np.linalg.norm(end - start) / FLIGHT_MM_PER_S / STEP_S * 1.9)))[:, None]
        for start, end in zip(corners, corners[1:])
    ]
    places = np.concatenate(places)
    shares = min_jerk(len(places))[:, None]
    axis = last.axis[-1] * (1 - shares) + following.axis[0] * shares
    nothing = np.zeros_like(places)
    return Motion(places, places, nothing * np.nan, nothing, axis)
