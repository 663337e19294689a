"""Linking and code generation: from LLVM bitcode to machine code, using only llvmlite.

The template of an entry point, the laws of a hammer and the values of its choices are linked to one module.
LLVM optimises the module as a whole and generates machine code for this processor.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, Final

import llvmlite.binding as llvm

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

ENTRY, CALL = "entry", "call"
"""Symbols of the entry point in its template, and of the wrapper that calls it with a block of arguments."""
LAW, CHOICE = "law.", "choice."
"""Prefixes of the symbols of laws and of choices; symbols of integer choices end with `.int`."""
INTEGER: Final = ".int"

COMMON: Final = "x86-64-v3"
"""x86-64 instruction-set level; all processors that support this level get the same machine code."""
_LEVEL_3: Final = [
    "avx2",
    "bmi",
    "bmi2",
    "cx16",
    "f16c",
    "fma",
    "lzcnt",
    "movbe",
    "popcnt",
    "sahf",
    "sse4.2",
    "xsave",
]

_OURS: Final = (ENTRY, LAW, CHOICE, "_ZN")
"""Prefixes of the symbols that must be defined after linking; `_ZN` is the prefix of numba's functions."""


def law_symbol(name: str, for_lanes: bool) -> str:
    """Return the symbol of a law function, in its version for lanes or for arrays of constants."""
    return f"{LAW}lane.{name}" if for_lanes else LAW + name


class LinkError(ValueError):
    """Error raised if modules cannot be linked."""


@cache
def _machine() -> Any:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    triple, name, features = processor()
    target = llvm.Target.from_triple(triple)
    # On x86, code that is loaded into a process must use static relocation.
    moving = {"x86": "static", "ppc": "pic"}.get(target.name[:3], "default")
    return target.create_target_machine(
        opt=3, cpu=name, features=features, reloc=moving, codemodel="jitdefault", jit=True
    )


@cache
def processor() -> tuple[str, str, str]:
    """Return the compilation target: triple of the system, name and features of the processor.

    Processors with the instructions of `COMMON` get code for that level, so that they compute the same bits,
    and the wheel contains a single copy of the machine code for all of them.
    """
    system, features = llvm.get_process_triple(), llvm.get_host_cpu_features()
    if system.startswith("x86_64-") and all(features.get(name) for name in _LEVEL_3):
        return system, COMMON, ""
    return system, llvm.get_host_cpu_name(), features.flatten()


def link(template: bytes, laws: Iterable[bytes], choices: Mapping[str, int], calling: str) -> Any:
    """Link the template of an entry point with laws, choices and the wrapper `calling`; return the module.

    Raises
    ------
    LinkError
        A module cannot be read, or a symbol is not defined by any module.
    """
    _machine()
    try:
        whole = llvm.parse_bitcode(template)
        whole.link_in(llvm.parse_assembly(_values(whole, choices)))
        for module in (*map(llvm.parse_bitcode, laws), llvm.parse_assembly(calling)):
            whole.link_in(module)
    except RuntimeError as error:
        raise LinkError(f"a module of the kernel cannot be read: {error}") from error
    for symbol in (*whole.functions, *whole.global_variables):
        if symbol.is_declaration and symbol.name.startswith(_OURS):
            raise LinkError(f"{symbol.name} is left open by a template and defined by no other module")
        if not symbol.is_declaration and symbol.name != CALL:
            # Only this module calls the function, so that it may be inlined and removed.
            symbol.linkage = "internal"
    return whole


def is_readable(bitcode: bytes) -> bool:
    """Whether the installed LLVM can read a module; bitcode of a later LLVM version may be unreadable."""
    try:
        llvm.parse_bitcode(bitcode)
    except RuntimeError:
        return False
    return True


def _values(template: Any, choices: Mapping[str, int]) -> str:
    """Return LLVM assembly that defines the choices of a template as constants."""
    lines = []
    for symbol in template.global_variables:
        name = symbol.name.removeprefix(CHOICE).removesuffix(INTEGER)
        if symbol.name.startswith(CHOICE) and name in choices:
            kind = "i64" if symbol.name.endswith(INTEGER) else "i8"
            lines.append(f"@{symbol.name} = constant {kind} {int(choices[name])}")
    return "\n".join(lines)


def emit(module: Any, machine: Any = None) -> bytes:
    """Optimise a module and return its machine code, for `machine` (default: this processor)."""
    machine = machine or _machine()
    # The module may have been lowered on a machine with another triple.
    module.triple, module.data_layout = machine.triple, str(machine.target_data)
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization, options.slp_vectorization = True, False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    return bytes(machine.emit_object(module))


_engines: list[Any] = []
"""Execution engines that own the loaded machine code; kept until the process exits."""


def load(code: bytes) -> int:
    """Load machine code; return the address of the wrapper that takes a block of arguments."""
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _machine())
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    _engines.append(engine)
    return int(engine.get_function_address(CALL))
