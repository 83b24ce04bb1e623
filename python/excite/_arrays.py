"""Arrays on their way in and out."""

from __future__ import annotations

from typing import Any, Iterable, Optional

import numpy as np
import numpy.typing as npt

from ._errors import unusable

Array = npt.NDArray[np.float64]


def floats(values: Iterable[Any]) -> Array:
    """Numbers of a JSON document as an array; what is not determined is ``nan``."""
    return np.array([np.nan if v is None else v for v in values], dtype=np.float64)


def pandas() -> Any:
    """pandas, or how to get it."""
    try:
        import pandas as found
    except ImportError:
        raise unusable("frames need pandas: pip install pandas") from None
    return found


def numbers(name: str, value: Any) -> Array:
    """``value`` as an array of float64; complex numbers, text and ragged lists are refused."""
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "fiub":
            raise TypeError(f"its numbers are of type {array.dtype}")
        return array.astype(np.float64, copy=False)
    except (TypeError, ValueError) as e:
        raise unusable(f"{name} must be an array of real numbers: {e}") from None


def finite(name: str, array: Array) -> Array:
    """Refuse what is not finite, with the place of the first."""
    good = np.isfinite(array)
    if not good.all():
        at = tuple(int(i) for i in np.argwhere(~good)[0])
        raise unusable(f"{name}{list(at)} is {array[at]}; all numbers must be finite")
    return array


def vector(name: str, value: Any, length: Optional[int] = None) -> Array:
    """A list of finite numbers, of this length."""
    array = numbers(name, value)
    if array.ndim != 1 or (length is not None and len(array) != length):
        want = "one-dimensional" if length is None else f"{length} numbers"
        raise unusable(f"{name} must be {want}; its shape is {array.shape}")
    return finite(name, array)


def rows(name: str, value: Any, width: int, what: str) -> Array:
    """``(samples, width)``; ``(width,)`` is one sample, ``(samples,)`` is accepted where the width is one."""
    array = numbers(name, value)
    if array.ndim == 1:
        array = array[:, None] if width == 1 and len(array) != 1 else array[None, :]
    if array.ndim != 2 or array.shape[1] != width:
        raise unusable(
            f"{name} must have the shape (samples, {width}), one column for each of {what}; its shape is "
            f"{np.shape(value)}"
        )
    return array


def by_column(array: Array) -> Array:
    """One column after the other; no copy where the columns are contiguous already."""
    return np.ascontiguousarray(array.T).reshape(-1)


def columns(array: Array) -> "list[Array]":
    """Each column on its own."""
    return [np.ascontiguousarray(c) for c in array.T]


def from_columns(flat: Array, width: int) -> Array:
    """``(samples, width)`` of a list of one column after the other, without a copy."""
    array: Array = flat.reshape(width, -1).T
    return array
