"""Calling convention between Python and the entry points of linked modules: one block of arguments.

The arguments of an entry point are numbers, arrays and nested tuples of them. The caller writes the flattened
arguments to a block of memory, eight bytes each, and passes the address of the block. An array is passed as
the address of its object, from which the module reads the address and shape of the data. With seventy
separate arguments instead of a block, a short call would take five times as long.
"""

from __future__ import annotations

import ctypes
import struct
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

Signature = Any
"""Type codes of the arguments, nested in tuples like the arguments: `i` is int64, `f` float64, `b` bool; `f2`
is a two-dimensional float64 array in C order, `s2` the same in float32, `i1` a one-dimensional int64
array."""

_ELEMENTS: Final = {"f": (np.float64, 8), "s": (np.float32, 4), "i": (np.int64, 8)}
_NUMBERS: Final = {"i": ("q", "i64"), "f": ("d", "double"), "b": ("?7x", "i8")}
_SLOT: Final = 8
"""Size of a slot of the argument block, bytes."""

# Byte offsets of fields in array objects and dtype descriptors, fixed by the binary interface of NumPy.
_DATA, _DIMENSIONS, _SHAPE, _STRIDES, _DESCRIPTION, _FLAGS = 16, 24, 32, 40, 56, 64
_BYTE_ORDER, _TYPE_NUMBER = 26, 28
_ORDERLY: Final = 0x1 | 0x100 | 0x400
"""NumPy flags that an array must have: C-contiguous, aligned and writeable."""


def _slots(signature: Signature, argument: str) -> Iterator[tuple[str, str]]:
    """Yield, for each slot of an argument, the Python expression of its value and its type code."""
    if isinstance(signature, str):
        yield (f"id({argument})" if len(signature) == 2 else argument), signature
    else:
        for i, element in enumerate(signature):
            yield from _slots(element, f"{argument}[{i}]")


def caller(address: int, signature: Signature, results: int) -> Callable[..., Any]:
    """Return a Python function that calls the compiled function at an address.

    The function returns None, an integer, or a tuple of integers, for 0, 1 or more `results`. It raises
    TypeError if an array does not match the signature.
    """
    names = [f"a{i}" for i in range(len(signature))]
    slots = [slot for name, one in zip(names, signature, strict=True) for slot in _slots(one, name)]
    formats = "".join("q" if len(letters) == 2 else _NUMBERS[letters][0] for _, letters in slots)
    arguments, given = struct.Struct("=" + formats), struct.Struct(f"={results}q")
    scope = {
        # A function without results still writes one null pointer, hence at least one result slot.
        "new_block": ctypes.c_char * (arguments.size + _SLOT * max(results, 1)),
        "pack": arguments.pack_into,
        "call": ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p)(address),
        "refuse": _refuse,
        "read": given.unpack_from,
    }
    value = f"read(block, {arguments.size})" + ("[0]" if results == 1 else "") if results else "None"
    # Generate straight-line code: a loop that flattens nested tuples would cost more than the call.
    source = f"""
def function({", ".join(names)}):
    block = new_block()
    pack(block, 0, {", ".join(slot for slot, _ in slots)})
    refused = call(block)
    if refused:
        refuse(refused, ({", ".join(names)},))
    return {value}
"""
    exec(source, scope)
    function: Callable[..., Any] = scope["function"]  # type: ignore[assignment]
    return function


def _refuse(code: int, arguments: tuple[Any, ...]) -> None:
    if code < 0:
        raise RuntimeError("a compiled function raised an exception")
    array = list(_flat(arguments))[code - 1]
    raise TypeError(
        f"value {code} for a compiled function: expected another type of array, or one in C order that can "
        f"be written to, got {getattr(array, 'dtype', type(array))} of shape {getattr(array, 'shape', ())}"
    )


def _flat(value: Any) -> Iterator[Any]:
    if isinstance(value, tuple):
        for element in value:
            yield from _flat(element)
    else:
        yield value


def calling_code(entry: str, signature: Signature, name: str, *, bare: bool = False) -> str:
    """Return LLVM assembly of a function `name` that reads a block of arguments and calls `entry`.

    The function returns 0 after success, -1 after an exception, or the number of the first slot whose array
    does not match the signature. In the block, the results follow the arguments. Outside Python (in
    WebAssembly), arrays are passed `bare`: the address of the elements, then the length along each axis,
    eight bytes each.
    """
    code: list[str] = []
    passed: list[tuple[str, str]] = []
    letters = [letters for _, letters in _slots(signature, "")]
    slots = 0
    for i, kind in enumerate(letters):
        code.append(f"%p{i} = getelementptr i8, ptr %block, i64 {_SLOT * slots}")
        slots += 1
        if len(kind) == 2 and bare:
            passed += _bare_array_code(i, kind, code)
            slots += int(kind[1])
        elif len(kind) == 2:
            passed += _array_code(i, kind, code)
        else:
            code.append(f"%v{i} = load {_NUMBERS[kind][1]}, ptr %p{i}")
            passed.append((_NUMBERS[kind][1], f"%v{i}"))
    types = ", ".join(["ptr", "ptr", *(kind for kind, _ in passed)])
    values = ", ".join(["ptr %result", "ptr %raised", *(f"{kind} {value}" for kind, value in passed)])
    body = "\n".join(code)
    return f"""
declare i32 @{entry}({types})
define i64 @{name}(ptr %block) {{
%raised = alloca ptr
%result = getelementptr i8, ptr %block, i64 {_SLOT * slots}
{body}
%code = call i32 @{entry}({values})
; The code -2 says that the result is None.
%number = icmp eq i32 %code, 0
%none = icmp eq i32 %code, -2
%succeeds = or i1 %number, %none
%returned = select i1 %succeeds, i64 0, i64 -1
ret i64 %returned
}}
"""


def _array_code(i: int, kind: str, code: list[str]) -> list[tuple[str, str]]:
    """Append to `code` the assembly that checks the array in slot `i` and reads its fields.

    `kind` is the type code of the array. Returns the arguments to pass for the array; see `_passed`.
    """
    dtype, _size = _ELEMENTS[kind[0]]
    count = int(kind[1])

    def field(name: str, place: str, offset: int, type_: str = "i64") -> str:
        value = f"%{name}.{i}"
        code.append(f"{value}.at = getelementptr i8, ptr {place}, i64 {offset}")
        code.append(f"{value} = load {type_}, ptr {value}.at")
        return value

    array = f"%array.{i}"
    code.append(f"{array} = load ptr, ptr %p{i}")
    dimensions = field("dimensions", array, _DIMENSIONS, "i32")
    flags = field("flags", array, _FLAGS, "i32")
    description = field("description", array, _DESCRIPTION, "ptr")
    number = field("number", description, _TYPE_NUMBER, "i32")
    order = field("order", description, _BYTE_ORDER, "i8")
    code += [
        f"%isdeep.{i} = icmp eq i32 {dimensions}, {count}",
        f"%masked.{i} = and i32 {flags}, {_ORDERLY}",
        f"%isorderly.{i} = icmp eq i32 %masked.{i}, {_ORDERLY}",
        f"%istype.{i} = icmp eq i32 {number}, {np.dtype(dtype).num}",
        f"%both.{i} = and i1 %isdeep.{i}, %isorderly.{i}",
        f"%isnative.{i} = icmp eq i8 {order}, {ord('=')}",
        f"%element.{i} = and i1 %istype.{i}, %isnative.{i}",
        f"%fits.{i} = and i1 %both.{i}, %element.{i}",
        f"br i1 %fits.{i}, label %taken.{i}, label %refused.{i}",
        f"refused.{i}:",
        f"ret i64 {i + 1}",
        f"taken.{i}:",
    ]
    data = field("data", array, _DATA, "ptr")
    shape, strides = field("shape", array, _SHAPE, "ptr"), field("strides", array, _STRIDES, "ptr")
    lengths = [field(f"length{axis}", shape, 8 * axis) for axis in range(count)]
    steps = [field(f"step{axis}", strides, 8 * axis) for axis in range(count)]
    return _passed(i, kind, code, data, lengths, steps)


def _bare_array_code(i: int, kind: str, code: list[str]) -> list[tuple[str, str]]:
    """Append to `code` the assembly that reads address and lengths of the bare array in slot `i`.

    `kind` is the type code of the array. Returns the arguments to pass for the array; see `_passed`.
    """
    count = int(kind[1])
    data, lengths = f"%data.{i}", [f"%length{axis}.{i}" for axis in range(count)]
    code.append(f"{data} = load ptr, ptr %p{i}")
    for axis, length in enumerate(lengths):
        code.append(f"{length}.at = getelementptr i8, ptr %p{i}, i64 {_SLOT * (axis + 1)}")
        code.append(f"{length} = load i64, ptr {length}.at")
    steps = [str(_ELEMENTS[kind[0]][1])]
    for axis in range(count - 1, 0, -1):
        code.append(f"%step{axis}.{i} = mul i64 {steps[0]}, {lengths[axis]}")
        steps.insert(0, f"%step{axis}.{i}")
    return _passed(i, kind, code, data, lengths, steps)


def _passed(
    i: int, kind: str, code: list[str], data: str, lengths: list[str], steps: list[str]
) -> list[tuple[str, str]]:
    """Return the arguments that pass an array to a function compiled by numba, as (type, value) pairs.

    Numba expects two owner pointers (unused here), the number and size of the elements, the address of the
    data, the shape and the strides. `data`, `lengths` and `steps` are the LLVM names of address, shape and
    strides; the assembly that counts the elements is appended to `code`.
    """
    items, size = "1", _ELEMENTS[kind[0]][1]
    for axis, length in enumerate(lengths):
        code.append(f"%items{axis}.{i} = mul i64 {items}, {length}")
        items = f"%items{axis}.{i}"
    whole = [("ptr", "null"), ("ptr", "null"), ("i64", items), ("i64", str(size)), ("ptr", data)]
    return whole + [("i64", value) for value in (*lengths, *steps)]
