"""WebAssembly modules: emitted by llvmlite for wasm32, linked by the linker in the wheel `ziglang`.

Each entry point becomes one object, from the same bitcode as its machine code. The linker joins the objects
of a kernel with the mathematical functions that they call, from zig's C library, which is musl. The module
imports nothing, so that every browser computes the same bits. It exports its memory, its entry points, and
the address `__heap_base` where free memory begins. An entry point takes the address of a block of arguments
(:func:`printhammer.kernel.compile.calls.calling_code`). The custom section `printhammer` is a JSON object
that describes the arguments; `call.mjs` follows the description when it writes the block for a call.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import llvmlite.binding as llvm

from printhammer.errors import PrinthammerError, missing_extra
from printhammer.kernel.compile import link

if TYPE_CHECKING:
    from collections.abc import Mapping

    from printhammer.kernel.compile.calls import Signature

SECTION: Final = "printhammer"
"""Name of the custom section of a WebAssembly module that holds the description of its entry points."""
MAGIC: Final = b"\0asm\1\0\0\0"
"""First bytes of a WebAssembly module: magic number and version."""

_FEATURES: Final = "+bulk-memory,+mutable-globals,+nontrapping-fptoint,+sign-ext,+simd128"
"""Features of WebAssembly 2.0, which browsers have supported since 2023."""
_POINTERS: Final = "-p:32:32-"
_PADDED: Final = "-p:32:64-"
"""Pointers in the data layout, with a size of four bytes and an alignment of eight.

Lowered templates hold the sizes and offsets of structures as numbers, computed for pointers of eight bytes;
with this alignment the numbers stay correct.
"""
_STACK: Final = 1 << 20
"""Size of the stack, in bytes; several times the stack use of an entry point."""


@cache
def _machine() -> Any:
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    return llvm.Target.from_triple("wasm32-unknown-unknown").create_target_machine(opt=3, features=_FEATURES)


def emit(module: Any, name: str) -> bytes:
    """Compile a linked module to a WebAssembly object file; its wrapper `CALL` is renamed to `name`."""
    module.get_function(link.CALL).name = name
    machine = _machine()
    layout = str(machine.target_data)
    if _POINTERS not in layout:
        raise link.LinkError(f"the data layout {layout!r} has no pointers {_POINTERS!r}")
    module.triple, module.data_layout = machine.triple, layout.replace(_POINTERS, _PADDED)
    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=3))
    builder.getModulePassManager().run(module, builder)
    return bytes(machine.emit_object(module))


def join(objects: Mapping[str, bytes], description: Mapping[str, Any]) -> bytes:
    """Link the objects of entry points, by name, into one WebAssembly module; append its description.

    Raises
    ------
    InputError
        The extra `page` is not installed.
    PrinthammerError
        The linker fails.
    """
    if find_spec("ziglang") is None:
        raise missing_extra("a module of WebAssembly needs ziglang", "page")
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder, f"{name}.o") for name in objects]
        for file, content in zip(files, objects.values(), strict=True):
            file.write_bytes(content)
        whole = Path(folder, "whole.wasm")
        options = [
            "--no-entry",
            "--strip-all",
            f"-z,stack-size={_STACK}",
            *(f"--export={name}" for name in (*objects, "__heap_base")),
        ]
        # A reactor has no main function, which would import what a program needs from its system.
        command = [sys.executable, "-m", "ziglang", "cc", "-target", "wasm32-wasi", "-mexec-model=reactor"]
        command += ["-nostartfiles", "-O2", *(f"-Wl,{option}" for option in options)]
        command += [*map(str, files), "-o", str(whole)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise PrinthammerError(f"zig cannot link a module of WebAssembly: {done.stderr.strip()}")
        return whole.read_bytes() + _section(SECTION, json.dumps(description).encode())


def description_of(signature: Signature) -> Any:
    """Convert a signature to JSON data: type codes, lists, and objects for named tuples."""
    if isinstance(signature, str):
        return signature
    if hasattr(signature, "_asdict"):
        return {name: description_of(element) for name, element in signature._asdict().items()}
    return [description_of(element) for element in signature]


def _section(name: str, content: bytes) -> bytes:
    """Encode a custom section of a WebAssembly module."""
    text = name.encode()
    payload = _unsigned(len(text)) + text + content
    return b"\0" + _unsigned(len(payload)) + payload


def _unsigned(number: int) -> bytes:
    """Encode an unsigned integer as LEB128."""
    encoded = bytearray()
    while number > 0x7F:
        encoded.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes([*encoded, number])
