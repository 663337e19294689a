"""Linking and emitting: from bitcode to machine code, by llvmlite alone.

The template of an entry point, the laws of a hammer and its choices become one module; LLVM optimises it as a
whole and makes machine code for this processor of it.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, Final

import llvmlite.binding as llvm

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

ENTRY, CALL = "entry", "call"
"""Symbols of an entry point in its template, and of the function that calls it with a block of arguments."""
LAW, CHOICE = "law.", "choice."
"""Prefixes of the symbols of laws and of choices; symbols of integer choices end with `.int`."""
INTEGER: Final = ".int"

_OURS: Final = (ENTRY, LAW, CHOICE, "_ZN")
"""Prefixes of the symbols that linking must define; the last one is that of numba's functions."""


def law_symbol(name: str, for_lanes: bool) -> str:
    """Return the symbol of a law for arrays of constants, or for lanes."""
    return f"{LAW}lane.{name}" if for_lanes else LAW + name


class LinkError(ValueError):
    """Modules that do not fit together."""


@cache
def _machine() -> Any:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    triple, name, features = processor()
    target = llvm.Target.from_triple(triple)
    # On x86, code that is loaded into a process has to be static.
    moving = {"x86": "static", "ppc": "pic"}.get(target.name[:3], "default")
    return target.create_target_machine(
        opt=3, cpu=name, features=features, reloc=moving, codemodel="jitdefault", jit=True
    )


@cache
def processor() -> tuple[str, str, str]:
    """Return the target of the machine code: triple of the system, name and features of the processor."""
    return llvm.get_process_triple(), llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


def link(template: bytes, laws: Iterable[bytes], choices: Mapping[str, int], calling: str) -> Any:
    """Return the module of an entry point with its laws and choices; `calling` is the text that calls it.

    Raises
    ------
    LinkError
        A module cannot be read, or leaves a name open that the others do not define.
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
            # Nobody else calls it: it may be inlined and left out.
            symbol.linkage = "internal"
    return whole


def is_readable(bitcode: bytes) -> bool:
    """Whether this LLVM reads a module; one that a later LLVM has written it may not."""
    try:
        llvm.parse_bitcode(bitcode)
    except RuntimeError:
        return False
    return True


def _values(template: Any, choices: Mapping[str, int]) -> str:
    """Return the text of a module with the values of a template's choices."""
    lines = []
    for symbol in template.global_variables:
        name = symbol.name.removeprefix(CHOICE).removesuffix(INTEGER)
        if symbol.name.startswith(CHOICE) and name in choices:
            kind = "i64" if symbol.name.endswith(INTEGER) else "i8"
            lines.append(f"@{symbol.name} = constant {kind} {int(choices[name])}")
    return "\n".join(lines)


def emit(module: Any, machine: Any = None) -> bytes:
    """Return machine code of a module, for this processor if no other `machine` is the target."""
    machine = machine or _machine()
    # That of the machine where it was lowered may be another.
    module.triple, module.data_layout = machine.triple, str(machine.target_data)
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization, options.slp_vectorization = True, False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    return bytes(machine.emit_object(module))


_engines: list[Any] = []
"""Engines that own the loaded machine code, kept as long as the process runs."""


def load(code: bytes) -> int:
    """Load machine code; return the address of the function that takes a block of arguments."""
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _machine())
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    _engines.append(engine)
    return int(engine.get_function_address(CALL))
