"""Arrays as text: the part of a run's numbers that a page carries, within a budget of bytes."""

import base64

import numpy as np

#: A base64 text is this much longer than its bytes.
BASE64 = 4 / 3


def packed(values, kind="f4"):
    """An array as {kind, shape, data}: little-endian, base64, rounded to `kind` ("f4", "u1", "u2", "u4")."""
    array = np.ascontiguousarray(values, dtype=f"<{kind}")
    return {"kind": kind, "shape": list(array.shape), "data": base64.b64encode(array.tobytes()).decode()}


def packed_levels(values):
    """An array as two bytes a value: 65535 levels over its range, NaN kept; half a level off at most.

    values : float array;  returns {kind, shape, data, low, step}: value = low + step times the number, 65535 is NaN.
    """
    values = np.asarray(values, float)
    known = np.isfinite(values)
    low, high = (float(values[known].min()), float(values[known].max())) if known.any() else (0.0, 0.0)
    step = (high - low) / 65534 or 1.0
    levels = np.where(known, np.rint((np.where(known, values, low) - low) / step), 65535)
    return {**packed(levels, "u2"), "low": low, "step": step}


def unpacked(entry):
    """The array that :func:`packed` or :func:`packed_levels` made a text of."""
    array = np.frombuffer(base64.b64decode(entry["data"]), dtype=f"<{entry['kind']}").reshape(entry["shape"])
    return array if "step" not in entry else np.where(array == 65535, np.nan, entry["low"] + entry["step"] * array)


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
