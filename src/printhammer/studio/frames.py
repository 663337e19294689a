"""Frames: the binary messages that the studio sends to a page.

A frame is the length of its heading (4 bytes, little-endian), the heading (JSON in UTF-8, padded with spaces
to a multiple of 8 bytes), and arrays in sequence, each padded likewise. The heading has ``kind``, ``serial``
(of the state that the frame answers), further entries, and ``arrays``: a list of name, dtype, shape and
offset from the end of the heading.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from printhammer.studio.bounds import LONGEST_REASON

_ALIGN: Final = 8
_NOTHING: Final[dict[str, dict[str, Any]]] = {"map": {"detail": "none"}, "strobe": {"verdict": None}}
_DTYPES: Final = {"f4": "<f4", "f8": "<f8", "u2": "<u2", "i4": "<i4", "u1": "|u1"}


def frame(kind: str, serial: int, arrays: Mapping[str, Any] | None = None, **entries: Any) -> bytes:
    """Encode a heading and arrays as a frame.

    Parameters
    ----------
    kind : str
        Kind of the content, such as "motion".
    serial : int
        Number of the state that the frame answers.
    arrays : mapping, optional
        Arrays by name: float32, float64, uint16, int32 or uint8; others are turned into float32.
    **entries
        The rest of the heading; NaN and infinity become null.
    """
    parts: list[bytes] = []
    listed: list[dict[str, Any]] = []
    offset = 0
    for name, values in (arrays or {}).items():
        array = np.asarray(values)
        code = f"{array.dtype.kind}{array.dtype.itemsize}"
        if code not in _DTYPES:
            code = "f4"
        data = np.ascontiguousarray(array, dtype=_DTYPES[code]).tobytes()
        listed.append({"name": name, "dtype": code, "shape": list(array.shape), "offset": offset})
        data += bytes(-len(data) % _ALIGN)
        parts.append(data)
        offset += len(data)
    heading = {"kind": kind, "serial": serial, **entries, "arrays": listed}
    text = json.dumps(plain(heading), allow_nan=False, separators=(",", ":")).encode()
    text += b" " * (-(4 + len(text)) % _ALIGN)
    return b"".join((struct.pack("<I", len(text)), text, *parts))


def nothing(view: str, serial: int, reason: object) -> bytes:
    """Encode a frame that tells the page to leave a view empty, with the reason."""
    return frame(view, serial, reason=str(reason), **_NOTHING.get(view, {}))


def refusal(serial: int, reason: str) -> bytes:
    """Encode a frame that refuses a request, with the reason."""
    return frame("refusal", serial, reason=reason[:LONGEST_REASON])


def unframe(data: bytes) -> tuple[dict[str, Any], dict[str, np.ndarray[Any, Any]]]:
    """Decode a frame; return the heading, and the arrays by name."""
    (length,) = struct.unpack_from("<I", data)
    heading = json.loads(data[4 : 4 + length])
    arrays = {}
    for entry in heading["arrays"]:
        count = math.prod(entry["shape"])
        values = np.frombuffer(data, _DTYPES[entry["dtype"]], count, 4 + length + entry["offset"])
        arrays[entry["name"]] = values.reshape(entry["shape"])
    return heading, arrays


def plain(value: Any) -> Any:
    """Convert a value to plain data for JSON: NaN and infinity to None, NumPy numbers to Python numbers."""
    # Test for numbers first: most values are numbers, and this takes a third of the time.
    if type(value) is float:
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(name): plain(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    if isinstance(value, np.generic | np.ndarray):
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
