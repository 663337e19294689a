"""Calls with a block of arguments: arguments, results, and invalid arguments."""

from typing import Any, NamedTuple

import llvmlite.binding as llvm
import numpy as np
import pytest

from printhammer.kernel.compile import calls, link

ARRAY = "ptr %o{0}, ptr %p{0}, i64 %n{0}, i64 %size{0}, ptr %data{0}, i64 %l{0}, i64 %s{0}"


def compiled(arguments: str, body: str, signature: Any, results: int) -> Any:
    """Return a Python function that calls a function written in LLVM assembly."""
    entry = f"define i32 @entry(ptr %result, ptr %raised, {arguments}) {{\n{body}\n}}"
    template = llvm.parse_assembly(entry).as_bitcode()
    module = link.link(template, [], {}, calls.calling_code("entry", signature, link.CALL))
    return calls.caller(link.load(link.emit(module)), signature, results)


def two_values(first: str, second: str) -> str:
    return f"""
store i64 {first}, ptr %result
%place = getelementptr i64, ptr %result, i64 1
store i64 {second}, ptr %place
ret i32 0"""


class Pair(NamedTuple):
    number: Any
    array: Any


@pytest.mark.parametrize("as_tuple", [lambda *values: values, Pair])
def test_tuples_are_passed_as_their_elements(as_tuple: Any) -> None:
    body = "store double %x, ptr %data0\n" + two_values("%k", "%n0")
    function = compiled(f"i64 %k, {ARRAY.format(0)}, double %x", body, (as_tuple("i", "f1"), "f"), 2)
    array = np.zeros(3)
    assert function(as_tuple(7, array), 2.5) == (7, 3)
    assert array.tolist() == [2.5, 0.0, 0.0]
    assert function(as_tuple(np.int64(-7), array[:1]), np.float64(-1.0)) == (-7, 1)
    assert array.tolist() == [-1.0, 0.0, 0.0]


@pytest.mark.parametrize(("value", "expected"), [(True, 1), (False, 0), (np.True_, 1)])
def test_a_truth_value_is_one_byte(value: Any, expected: int) -> None:
    body = "%wide = zext i8 %b to i64\nstore i64 %wide, ptr %result\nret i32 0"
    assert compiled("i8 %b", body, ("b",), 1)(value) == expected


def test_shape_and_strides_are_those_of_the_array() -> None:
    parameters = "ptr %o, ptr %p, i64 %n, i64 %size, ptr %data, i64 %l0, i64 %l1, i64 %s0, i64 %s1"
    for first, second, expected in (
        ("%l0", "%l1", (3, 5)),
        ("%s0", "%s1", (20, 4)),
        ("%n", "%size", (15, 4)),
    ):
        function = compiled(parameters, two_values(first, second), ("s2",), 2)
        assert function(np.zeros((3, 5), np.float32)) == expected
    assert function(np.zeros((0, 5), np.float32)) == (0, 4)


def test_no_result_is_none_and_leaves_the_memory_behind_the_block_alone() -> None:
    # As numba's functions do: a null pointer for None, and a code for it.
    function = compiled("i64 %k", "store ptr null, ptr %result\nret i32 -2", ("i",), 0)
    assert [function(i) for i in range(1000)] == [None] * 1000


@pytest.mark.parametrize("code", [-1, 1, 5])
def test_an_exception_of_compiled_code_is_one_of_python(code: int) -> None:
    with pytest.raises(RuntimeError):
        compiled("i64 %k", f"ret i32 {code}", ("i",), 1)(0)


@pytest.mark.parametrize(
    "array",
    [
        np.zeros(3, np.float32),
        np.zeros(3, np.int64),
        np.zeros((3, 1)),
        np.zeros(6)[::2],
        np.zeros(3).astype(">f8"),
        np.frombuffer(bytes(24)),
    ],
    ids=["float32", "int64", "two dimensions", "not in order", "bytes swapped", "read only"],
)
def test_another_array_is_refused_by_its_place(array: Any) -> None:
    parameters = f"i64 %k, {ARRAY.format(0)}"
    function = compiled(parameters, "store i64 1, ptr %result\nret i32 0", (("i", "f1"),), 1)
    assert function((0, np.zeros(3))) == 1
    with pytest.raises(TypeError, match="value 2 "):
        function((0, array))
