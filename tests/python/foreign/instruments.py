"""A tracker of the handle and a force sensor in it; mm, N, s. Poses and wrenches have clocks and rates of their own."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from .hand import STEP_S
from .noise import low_pass, ornstein_uhlenbeck, settling

SENSOR_HZ = 500


@dataclass
class Tracker:
    rate_hz: float
    # of a frame's time, as a share of the period
    jitter: float
    delay_s: float
    white_mm: float
    wander_mm: float
    wander_s: float
    turn_rad: float
    turn_wander_rad: float
    outlier_share: float
    lost_share: float
    # centre of the ball from the tracked origin, in its axes
    tip_mm: np.ndarray

    def frames(self, held, turns, rng):
        """Stamps, positions and orientations (x, y, z, w) of the tracked body."""
        period = 1 / self.rate_hz
        end = (len(held) - 2) * STEP_S
        times = np.arange(period, end - period, period)
        times = times + period * self.jitter * rng.uniform(-1, 1, len(times))
        times = times[rng.random(len(times)) >= self.lost_share]
        at = times / STEP_S
        low, share = at.astype(int), (at % 1)[:, None]
        tip = held[low] * (1 - share) + held[low + 1] * share
        # the orientation turns by less than 0.01° in a step
        body = turns[low]
        noise = ornstein_uhlenbeck(rng, self.turn_wander_rad, self.wander_s, period, (len(times), 3))
        measured = body * Rotation.from_rotvec(noise + rng.normal(0, self.turn_rad, noise.shape))
        place = tip - body.apply(self.tip_mm)
        place = place + ornstein_uhlenbeck(rng, self.wander_mm, self.wander_s, period, place.shape) + rng.normal(0, self.white_mm, place.shape)
        is_out = rng.random(len(times)) < self.outlier_share
        place[is_out] += rng.normal(0, 1.5, (is_out.sum(), 3))
        return times + self.delay_s, place, measured.as_quat()


@dataclass
class ForceSensor:
    cutoff_hz: float
    # 3 × 3, near 1
    cross_talk: np.ndarray
    bias_n: np.ndarray
    white_n: float
    drift_n: float
    drift_s: float
    # added over the recording as the sensor warms up, N and s
    warming_n: np.ndarray
    warming_s: float
    step_n: float

    def readings(self, force, turns, rng):
        """Stamps and forces in the axes of the stylus."""
        felt = low_pass(turns.inv().apply(force) @ self.cross_talk.T, self.cutoff_hz, STEP_S)
        every = round(1 / STEP_S / SENSOR_HZ)
        felt = felt[::every]
        count, step_s = len(felt), every * STEP_S
        warm = np.ones((count, 3))
        warm[0] = 0
        zero = self.bias_n + self.warming_n * settling(warm, self.warming_s, step_s)
        zero = zero + ornstein_uhlenbeck(rng, self.drift_n, self.drift_s, step_s, felt.shape)
        read = felt + zero + rng.normal(0, self.white_n, felt.shape)
        return np.arange(count) * step_s, np.round(read / self.step_n) * self.step_n


def turns_of(axis, spin):
    """Orientation with z along each axis, turned about it by each angle."""
    x = np.cross(np.array([0.31, 0.87, 0.38]), axis)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    upright = Rotation.from_matrix(np.stack([x, np.cross(axis, x), axis], axis=2))
    return upright * Rotation.from_rotvec(spin[:, None] * [0.0, 0.0, 1.0])
