"""A kind of mistake: its sizes, and how it changes a recording."""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from .recording import Recording

# name: (function of a recording and a size, sizes by name)
KINDS = {}
DIAGONAL = np.ones(3) / np.sqrt(3)
AXES = dict(zip("xyz", np.eye(3)))
WHOLE = {"whole": 1.0}


@dataclass
class Changed:
    """A recording with a mistake in it."""

    recording: Recording
    # what changed, in words
    what: str
    # true numbers by the names that the program gives them
    numbers: dict = field(default_factory=dict)
    # told otherwise than it is: keys of the scene
    told: dict = field(default_factory=dict)
    # the scan is larger than the part by this factor
    scan_scale: float = 1.0


def three(small, middle, large):
    return {"small": small, "middle": middle, "large": large}


def add(name, sizes, make, *of_make, **by_name):
    """- `make`: of a recording, a size, and the rest."""
    assert name not in KINDS, name
    KINDS[name] = (lambda recording, size: make(recording, size, *of_make, **by_name), sizes)


def since(time_s, recording, at):
    """1 from this share of the session on, 0 before."""
    return (time_s >= at * recording.facts["duration_s"]).astype(float)


def evenly(time_s, recording):
    """0 to 1 over the session."""
    return np.clip(time_s / recording.facts["duration_s"], 0, 1)


def numbers_of(prefix, vector, unit):
    return {f"{prefix}_{axis}_{unit}": float(size) for axis, size in zip("xyz", vector)}


def lagged(values, time_s, step_s):
    """First-order lag along axis 0, at rest at the first value."""
    keep = np.exp(-step_s / time_s)
    return values[0] + lfilter([1 - keep], [1.0, -keep], values - values[0], axis=0)


def wander(rng, size, time_s, step_s, shape):
    """Gaussian noise with the autocovariance size² exp(−|τ| / time_s)."""
    keep = np.exp(-step_s / time_s)
    drive = rng.normal(0, size * np.sqrt(1 - keep**2), shape)
    drive[0] *= 1 / np.sqrt(1 - keep**2)
    return lfilter([1.0], [1.0, -keep], drive, axis=0)


def windows(rng, recording, count, length_s):
    """Whether a time is in one of some windows spread over the session: a function of times."""
    duration = recording.facts["duration_s"]
    starts = (np.arange(count) + rng.uniform(0.2, 0.8, count)) * duration / count

    def number(time_s):
        at = np.searchsorted(starts, time_s) - 1
        is_in = (at >= 0) & (time_s < starts[np.maximum(at, 0)] + length_s)
        return np.where(is_in, at, -1)

    return number


def turned_by_hand(recording, largest_deg, rng):
    """The stylus turned about the centre of its ball along a smooth random course, as a hand does."""
    period_s, phase, weight = rng.uniform(3, 15, (5, 3)), rng.uniform(0, 2 * np.pi, (5, 3)), rng.normal(size=(5, 3))

    def course(time_s):
        return (weight * np.sin(2 * np.pi * time_s[:, None, None] / period_s + phase)).sum(axis=1)

    scale = np.radians(largest_deg) / np.linalg.norm(course(recording.pose.time_s), axis=1).max()
    turns = Rotation.from_rotvec(scale * course(recording.pose.time_s))
    back = Rotation.from_rotvec(scale * course(recording.wrench_time_s())).inv()
    wrench = np.hstack([back.apply(recording.wrench.values[:, of]) for of in (slice(3), slice(3, 6))])
    turned = recording.with_turns(recording.turns() * turns)
    return replace(turned, wrench=replace(turned.wrench, values=wrench))
