"""Coloured noise and filters of instruments; arrays run over time along axis 0."""

import numpy as np
from scipy.signal import butter, lfilter, lfilter_zi, sosfilt, sosfilt_zi


def ornstein_uhlenbeck(rng, std, time_s, step_s, shape):
    """Stationary wander with the autocovariance std² exp(−|τ| / time_s), by its exact discrete form."""
    keep = np.exp(-step_s / time_s)
    drive = rng.normal(0, std * np.sqrt(1 - keep**2), shape)
    drive[0] = rng.normal(0, std, shape[1:])
    return lfilter([1.0], [1.0, -keep], drive, axis=0)


def band(rng, low_hz, high_hz, std, step_s, shape):
    """Gaussian noise of a frequency band, with the standard deviation `std`."""
    sections = butter(2, [low_hz, high_hz], "bandpass", fs=1 / step_s, output="sos")
    # the filter has settled after three periods of its lowest frequency
    settle = int(3 / low_hz / step_s)
    made = sosfilt(sections, rng.normal(size=(shape[0] + settle, *shape[1:])), axis=0)[settle:]
    impulse = np.zeros(40 * settle)
    impulse[0] = 1
    return made * (std / np.sqrt((sosfilt(sections, impulse) ** 2).sum()))


def low_pass(signal, cutoff_hz, step_s):
    """Second-order Butterworth low-pass, at rest at the first value."""
    sections = butter(2, cutoff_hz, fs=1 / step_s, output="sos")
    state = sosfilt_zi(sections)[:, :, None] * signal[0]
    return sosfilt(sections, signal, axis=0, zi=state)[0]


def settling(signal, time_s, step_s):
    """First-order lag, at rest at the first value."""
    keep = np.exp(-step_s / time_s)
    b, a = [1 - keep], [1.0, -keep]
    return lfilter(b, a, signal, axis=0, zi=lfilter_zi(b, a)[:, None] * signal[0])[0]


def min_jerk(steps):
    """Shares of a path from rest to rest, 0 to 1, with the least jerk."""
    share = np.linspace(0, 1, steps)
    return share**3 * (10 - 15 * share + 6 * share**2)
