"""Frames: what is put into one comes out of it, and arrays lie where a browser can view them."""

import json
import math
import struct

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from printhammer.studio.frames import frame, plain, unframe

DTYPES = st.sampled_from(["<f4", "<f8", "<u2", "<i4", "|u1"])
ARRAYS = DTYPES.flatmap(lambda dtype: arrays.arrays(dtype, arrays.array_shapes(max_dims=2, max_side=9)))
TOLD = st.dictionaries(st.sampled_from(["status", "reason", "µ"]), st.text() | st.floats() | st.integers())


@given(st.dictionaries(st.text(max_size=9), ARRAYS, max_size=4), TOLD)
def test_what_is_put_in_comes_out(data: dict[str, np.ndarray], told: dict[str, object]) -> None:
    heading, found = unframe(frame("motion", 7, data, **told))
    assert (heading["kind"], heading["serial"]) == ("motion", 7)
    assert {name: heading[name] for name in told} == plain(told)
    assert list(found) == list(data)
    for name, array in data.items():
        assert found[name].dtype == array.dtype
        np.testing.assert_array_equal(found[name], array)


@given(st.lists(ARRAYS, max_size=4))
def test_arrays_begin_at_multiples_of_eight(data: list[np.ndarray]) -> None:
    whole = frame("map", 1, {str(k): array for k, array in enumerate(data)})
    (length,) = struct.unpack_from("<I", whole)
    assert (4 + length) % 8 == 0
    assert all(entry["offset"] % 8 == 0 for entry in json.loads(whole[4 : 4 + length])["arrays"])


def test_other_numbers_become_float32() -> None:
    _, found = unframe(frame("motion", 1, {"n": [1, 2], "h": np.float16([0.5])}))
    assert [array.dtype for array in found.values()] == [np.float32, np.float32]


def test_a_heading_never_holds_a_number_that_json_does_not_know() -> None:
    heading, _ = unframe(frame("dots", 1, a=math.nan, b=[math.inf, {"c": np.float64("nan")}], d=np.arange(2)))
    assert (heading["a"], heading["b"], heading["d"]) == (None, [None, {"c": None}], [0, 1])
