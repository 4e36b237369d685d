"""Arrays as the native half takes them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._touchup import TouchupError

MeshArrays = tuple[NDArray[np.float64], NDArray[np.uint32]]


def error(message: str, kind: str = "usage", exit_code: int = 2) -> TouchupError:
    """The exception of a caller's mistake."""
    made = TouchupError(message)
    made.kind, made.hint, made.exit_code = kind, None, exit_code
    return made


def floats(given: ArrayLike, columns: int, name: str) -> NDArray[np.float64]:
    """Array (N, `columns`) of float64, without a copy of one of this type; refuses a value that is no number."""
    if isinstance(given, np.ma.MaskedArray) and np.ma.is_masked(given):
        raise error(f"{name} has masked values, which stand for no number: leave their rows out")
    kind = np.asarray(given).dtype
    if not (np.issubdtype(kind, np.integer) or np.issubdtype(kind, np.floating)):
        raise error(f"{name} is an array of {kind}; it must be of numbers")
    array = np.ascontiguousarray(given, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != columns:
        raise error(f"{name} is an array of shape {array.shape}; it must be (N, {columns})")
    return array


def stamps(given: ArrayLike, name: str) -> NDArray[np.int64]:
    """Stamps (N,), ns; of numbers with a fraction it is not known whether they are seconds."""
    array = np.asarray(given)
    if array.ndim != 1 or not np.issubdtype(array.dtype, np.integer):
        raise error(
            f"{name} is an array of shape {array.shape} of {array.dtype}; it must be (N,) of whole ns: "
            "of seconds make (t * 1e9).astype(numpy.int64)"
        )
    return np.ascontiguousarray(array, dtype=np.int64)
