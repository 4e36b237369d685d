"""Strokes of a guided hand: walks of the ball's centre over the true part, each reached along a free axis from one side; mm.

A walk keeps its direction over faces, around edges and around the walls of holes, until the shaft would hit the part.
"""

from dataclasses import dataclass

import numpy as np
import trimesh

AXES = {f"{sign}{name}": (1 if not sign else -1) * np.eye(3)[at] for at, name in enumerate("xyz") for sign in ("", "-")}
STEP_MM = 0.5
LENGTH_MM = 90.0
SHORTEST_MM = 5.0
# distance between strokes on a surface that faces the hand, and on a wall, mm
SPACING_MM, WALL_SPACING_MM = 3.0, 1.5
WALL_COSINE = 0.6
FEWEST, MOST = 4, 40
# smallest reachable area that the hand strokes, mm²
LEAST_MM2 = 10.0
CANDIDATES = 20_000
# the shaft is thinner than the ball
SHAFT = 0.7
TILT_RAD = np.radians(14)
WALL_TILT_RAD = np.radians(3)
# clearance of the planes on which the hand travels from the part's box, beside the ball, mm
CLEAR_MM = 6.0


@dataclass
class Stroke:
    side: str
    # of the shaft, towards the hand
    axis: np.ndarray
    # places of the centre of the ball and normals there
    centres: np.ndarray
    normals: np.ndarray


def is_reached(surface, centres, axes, radius):
    """Whether the shaft along each axis from each centre is free of the part."""
    aside = np.cross(axes, np.eye(3)[np.abs(axes).argmin(axis=1)])
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    is_free = np.ones(len(centres), bool)
    for across in (0 * aside, aside, -aside, np.cross(axes, aside), -np.cross(axes, aside)):
        is_free &= surface.first_hits(centres + SHAFT * radius * across, axes)[0] < 0
    return is_free


def tilted(axis, angles, turns):
    """The axis tilted by each angle towards each turn about it."""
    x = np.roll(axis, 1)
    y = np.cross(axis, x)
    towards = np.cos(turns)[:, None] * x + np.sin(turns)[:, None] * y
    return np.cos(angles)[:, None] * axis + np.sin(angles)[:, None] * towards


def starts(surface, sides, radius, rng):
    """Starts of strokes: points, normals and sides, by patches, so that small ones get theirs too."""
    mesh = surface.mesh
    points, faces = trimesh.sample.sample_surface(mesh, CANDIDATES, seed=int(rng.integers(2**31)))
    points, faces = np.asarray(points), np.asarray(faces)
    normals = mesh.face_normals[faces]
    centres = points + radius * normals
    fits = surface.nearest(centres)[0] > radius * (1 - 0.002)
    best, best_cosine = np.full(len(points), -1), np.full(len(points), -0.2)
    for at, side in enumerate(sides):
        axis = AXES[side]
        cosine = normals @ axis + 0.05 * rng.random(len(points))
        ahead = np.flatnonzero(fits & (cosine > best_cosine))
        ahead = ahead[is_reached(surface, centres[ahead], np.tile(axis, (len(ahead), 1)), radius)]
        best[ahead], best_cosine[ahead] = at, cosine[ahead]
    area_of_point = mesh.area / CANDIDATES
    chosen = []
    for patch in range(surface.patch_of.max() + 1):
        for at in range(len(sides)):
            here = np.flatnonzero((surface.patch_of[faces] == patch) & (best == at))
            area = len(here) * area_of_point
            if area > LEAST_MM2:
                spacing = WALL_SPACING_MM if np.median(best_cosine[here]) < WALL_COSINE else SPACING_MM
                count = int(np.clip(area / (spacing * min(LENGTH_MM, np.sqrt(4 * area))), FEWEST, MOST))
                chosen.append(rng.choice(here, min(count, len(here)), replace=False))
    chosen = np.concatenate(chosen)
    return points[chosen], normals[chosen], best[chosen]


def walked(surface, centres, normals, directions, radius):
    """Centres and normals of a walk from each centre: steps × walks × 3."""
    all_centres, all_normals = [centres], [normals]
    for _ in range(int(LENGTH_MM / STEP_MM)):
        ahead = centres + STEP_MM * directions
        distance, nearest, _ = surface.nearest(ahead)
        out = (ahead - nearest) / np.maximum(distance, 1e-9)[:, None]
        moved = nearest + radius * out
        # a wall ahead stops the walk in the corner
        step = moved - centres
        turned = directions - out * (directions * out).sum(axis=1, keepdims=True)
        length = np.linalg.norm(turned, axis=1, keepdims=True)
        is_stopped = (length < 0.3) | ((step * directions).sum(axis=1, keepdims=True) < 0.1 * STEP_MM)
        centres = np.where(is_stopped, centres, moved)
        normals = np.where(is_stopped, normals, out)
        directions = np.where(is_stopped, 0.0, turned / np.maximum(length, 1e-9))
        all_centres.append(centres)
        all_normals.append(normals)
    return np.array(all_centres), np.array(all_normals)


def strokes_over(surface, sides, radius, rng):
    """Strokes, side by side, in a random order on each."""
    points, normals, of_side = starts(surface, sides, radius, rng)
    axes = np.array([AXES[side] for side in sides])[of_side]
    is_wall = (normals * axes).sum(axis=1) < WALL_COSINE
    # level on walls, with a little pitch; any direction on faces
    level = np.cross(axes, normals) * rng.choice([-1, 1], len(points))[:, None] + rng.normal(0, 0.06, (len(points), 1)) * axes
    anywhere = rng.normal(size=points.shape)
    directions = np.where(is_wall[:, None], level, anywhere)
    directions -= normals * (directions * normals).sum(axis=1, keepdims=True)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    centres, along = walked(surface, points + radius * normals, normals, directions, radius)
    turns = rng.uniform(0, 2 * np.pi, len(points))
    angles = np.abs(rng.normal(0, 1, len(points))) * np.where(is_wall, WALL_TILT_RAD, TILT_RAD)
    made = []
    for at, side in enumerate(sides):
        mine = np.flatnonzero(of_side == at)
        leaning = tilted(AXES[side], np.minimum(angles[mine], 2 * TILT_RAD), turns[mine])
        for one, axis in zip(mine, leaning):
            # upright if the tilted shaft does not get in
            tried = (cut_to_reach(surface, side, shaft, centres[:, one], along[:, one], radius) for shaft in (axis, AXES[side]))
            made += [stroke for stroke in tried if stroke][:1]
    return made


def cut_to_reach(surface, side, axis, centres, normals, radius):
    """The stroke up to its first place out of reach, or None if that is too short."""
    length = np.concatenate([[0], np.linalg.norm(np.diff(centres, axis=0), axis=1).cumsum()])
    count = np.searchsorted(length, length[-1] - 1e-9) + 1
    is_free = is_reached(surface, centres[:count], np.tile(axis, (count, 1)), radius)
    count = count if is_free.all() else int(is_free.argmin())
    if count < 2 or length[count - 1] < SHORTEST_MM:
        return None
    return Stroke(side, axis, centres[:count], normals[:count])


def safe_plane(mesh, side, radius):
    """Height along a side's axis at which the hand travels."""
    return (mesh.vertices @ AXES[side]).max() + radius + CLEAR_MM


def way_between(mesh, before, start, after, end, radius):
    """Corners of a free way between two places on the planes of two sides, each leg within a plane."""
    if before == after:
        return np.array([start, end])

    def onto(side, place):
        return place + AXES[side] * (safe_plane(mesh, side, radius) - place @ AXES[side])

    if AXES[before] @ AXES[after] == 0:
        return np.array([start, onto(after, start), end])
    # opposite: over a third side
    over = onto("x" if after in ("z", "-z") else "z", start)
    return np.array([start, over, onto(after, over), end])
