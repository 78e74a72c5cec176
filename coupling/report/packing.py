"""The numbers of a page as one compressed text: JSON in which arrays stand as places in the bytes behind it."""

import base64
import json
import struct
import zlib
from typing import NamedTuple

import numpy as np

ALIGNMENT = 4


class Levels(NamedTuple):
    """An array kept as two bytes a value: 65535 levels over its range, NaN kept; half a level off at most.

    low, step : value = low + step times the number (u2), 65535 is NaN.
    """

    numbers: np.ndarray
    low: float
    step: float

    def values(self):
        """The array again, float64."""
        return np.where(self.numbers == 65535, np.nan, self.low + self.step * self.numbers)


def levels(values):
    """A float array of any shape as :class:`Levels`."""
    values = np.asarray(values, float)
    known = np.isfinite(values)
    low, high = (float(values[known].min()), float(values[known].max())) if known.any() else (0.0, 0.0)
    step = (high - low) / 65534 or 1.0
    numbers = np.where(known, np.rint((np.where(known, values, low) - low) / step), 65535)
    return Levels(numbers.astype("u2"), low, step)


def packed(data):
    """What JSON can hold, arrays and :class:`Levels` as one text of base64 over deflate.

    Behind the length of the JSON (4 bytes) and the JSON itself stand the bytes of the arrays, little-endian; each is
    {kind, shape, at} in the JSON, and low and step for levels. Floats are rounded to f4, integers keep their kind.
    """
    parts, size = [], 0

    def stored(value):
        nonlocal size
        if not isinstance(value, np.ndarray):
            raise TypeError(f"page: arrays and JSON only, got {type(value).__name__}")
        kind = f"u{value.dtype.itemsize}" if value.dtype.kind == "u" else "f4"
        content = np.ascontiguousarray(value, dtype=f"<{kind}").tobytes()
        entry = {"kind": kind, "shape": list(value.shape), "at": size}
        parts.append(content + bytes(-len(content) % ALIGNMENT))
        size += len(parts[-1])
        return entry

    def plain(value):
        if isinstance(value, Levels):
            return {**stored(value.numbers), "low": value.low, "step": value.step}
        if isinstance(value, dict):
            return {key: plain(part) for key, part in value.items()}
        return [plain(part) for part in value] if isinstance(value, list | tuple) else value

    head = json.dumps(plain(data), separators=(",", ":"), allow_nan=False, default=stored).encode()
    head += b" " * (-len(head) % ALIGNMENT)
    return base64.b64encode(zlib.compress(struct.pack("<I", len(head)) + head + b"".join(parts), 9)).decode()


def quantised(values, low, high, kind="u1"):
    """Values between `low` and `high` as whole numbers from 0; what lies outside is drawn at the end of the range.

    values : (n,) float;  returns (n,) of an unsigned `kind`. NaN becomes 0.
    """
    top = np.iinfo(kind).max
    share = (np.asarray(values, float) - low) / (high - low)
    return np.rint(np.clip(np.nan_to_num(share), 0.0, 1.0) * top).astype(kind)


def evenly(count, most):
    """At most `most` of `count` indices, evenly spread, the first and the last among them: (n,) int64."""
    if count <= most:
        return np.arange(count)
    return np.unique(np.rint(np.linspace(0, count - 1, max(most, 2))).astype(int))
