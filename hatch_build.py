"""Build hook of the wheel: adds lowered modules and code of shipped hammers (decisions 0026, 0029)."""

from __future__ import annotations

import atexit
import lzma
import os
import subprocess
import sys
import tempfile
from contextlib import suppress
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    Files = Iterator[tuple[str, Callable[[], bytes | None]]]
    """Names of generated files, each with a function that returns the content, or None."""

_ABSENT = {"magnet": "", "spring": "", "pack": "", "backstop": "", "absent": "printhammer.parts.absent"}
_MODULES = "PRINTHAMMER_MODULES"
"""Environment variable with a folder of lowered modules, which are then not lowered again."""
_COMPILED = "PRINTHAMMER_COMPILED"
"""Environment variable with the shipped hammers whose machine code is compiled; all of them without it."""
_LOWER = "--lower"
"""Option of this file as a program: write the lowered modules only."""
_MOST_WORKERS = 8
"""Largest number of processes; each needs up to half a gigabyte of memory."""


class LoweredModules(BuildHookInterface[Any]):
    """Build hook that lowers all entry-point templates and the laws of all shipped parts into the wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the generated files to the wheel; an editable installation generates them on demand instead."""
        if version == "editable":
            return
        folder = tempfile.TemporaryDirectory()
        atexit.register(folder.cleanup)
        command = [sys.executable, str(Path(self.root, "hatch_build.py")), folder.name]
        count = min(os.cpu_count() or 1, _MOST_WORKERS)
        workers = [subprocess.Popen(command, cwd=self.root) for _ in range(count)]
        try:
            codes = [worker.wait() for worker in workers]
            if any(codes):
                raise RuntimeError("the kernel's modules cannot be generated")
        finally:
            for worker in workers:
                worker.kill()
        for path in Path(folder.name).iterdir():
            if path.is_file():
                build_data["force_include"][str(path)] = f"printhammer/kernel/modules/{path.name}"


def lowered_modules() -> Files:
    """Yield the lowered modules: of all templates, and of the laws of all parts."""
    from numba import TypingError

    from printhammer.kernel import schemes_1983
    from printhammer.kernel.compile.bindings import bindings_of
    from printhammer.kernel.compile.modules import Module, every_template, laws_of, plain_template
    from printhammer.kernel.model.laws import LAW_FUNCTIONS, Laws
    from printhammer.parts import PARTS
    from printhammer.parts.friction import DryFriction
    from printhammer.parts.spring.forces import ForceSum
    from printhammer.parts.spring.sums import DampedForceSum
    from printhammer.run.plain import entries

    def lowered(module: Module) -> tuple[str, Callable[[], bytes | None]]:
        def content() -> bytes | None:
            # A law of more constants than a lane has room for never runs in lanes.
            with suppress(TypingError):
                return lzma.compress(module.content(), preset=9)
            return None

        return module.shipped.name, content

    scheme = plain_template("scheme", schemes_1983.PROGRAM, False)
    yield from map(lowered, (*every_template(), *entries.templates(), scheme))
    for role in LAW_FUNCTIONS:
        parts = {part.__module__ for (known, _), part in PARTS.items() if known == role}
        parts |= {part.__module__ for part in (DampedForceSum, DryFriction, ForceSum) if part.role == role}
        for name in ("", *sorted(parts)):
            bindings = bindings_of(Laws(**{**_ABSENT, role: name}))
            yield from (lowered(laws_of(role, bindings, for_lanes)) for for_lanes in (False, True))


def compiled_code() -> Files:
    """Yield WebAssembly modules and machine code for the laws of the shipped hammers."""
    from printhammer.drive.trains import PulseTrain, SineForce
    from printhammer.hammer.hammer import load, shipped
    from printhammer.kernel.compile import link
    from printhammer.kernel.compile.cache import sealed
    from printhammer.kernel.compile.lanes import specialise_lanes, suits
    from printhammer.kernel.compile.modules import Entry, WebModule
    from printhammer.kernel.compile.specialise import specialise, variational
    from printhammer.run import problem
    from printhammer.run.ensemble_group import closed_form
    from printhammer.run.plain import entries

    def web(module: WebModule) -> tuple[str, Callable[[], bytes]]:
        return module.shipped.name, lambda: lzma.compress(module.content(), preset=9)

    def machine(entry: Entry) -> tuple[str, Callable[[], bytes]]:
        return entry.code.shipped.name, lambda: sealed(entry.code.get(entry.machine_code))

    hammers = [load(name) for name in shipped()]
    # A textbook oscillator has no pulse of its own, and is driven by a force.
    drives = [PulseTrain(each.waveform) if each.waveform else SineForce(1.0, 1.0) for each in hammers]
    posed = [(*each, problem.laws_of(*each)) for each in zip(hammers, drives, strict=True)]
    # The longest compilations, those with a circuit, begin first: the processes then end together.
    posed.sort(key=lambda each: not each[2].circuit)
    yield from (web(entries.page_module(laws)) for _hammer, _drive, laws in posed)
    # In a page, a current or a voltage can drive the coil.
    coils = [each for each in hammers if each.magnet is not None and each.magnet.has_linkage]
    for quantity in ("voltage", "current"):
        yield from (web(entries.page_module(problem.laws_of(each, quantity))) for each in coils)
    # Processors of the level COMMON share their machine code; that of others runs nowhere else.
    if link.processor()[1] != link.COMMON:
        return
    wanted = os.environ.get(_COMPILED, " ".join(shipped())).split()
    for hammer, drive, laws in posed:
        if hammer.name not in wanted:
            continue
        kernel = specialise(laws)
        _rates, kinds = closed_form(drive.kernel_arrays()[2])
        kernels = [variational(kernel, forced=True), variational(kernel, forced=False), kernel]
        if suits(laws) and kinds is not None:
            kernels.append(specialise_lanes(laws, kinds))
        yield from (machine(entry) for each in kernels for entry in each.entries)


def generate(folder: Path, files: Files) -> None:
    """Write the files that no other process has begun to a folder that the processes share."""
    begun = folder / "begun"
    begun.mkdir(parents=True, exist_ok=True)
    for name, make in files:
        try:
            (begun / name).touch(exist_ok=False)
        except FileExistsError:
            continue
        content = make()
        if content is not None:
            (folder / name).write_bytes(content)


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent / "src"))
    from printhammer.kernel.compile import modules

    target, *options = sys.argv[1:]
    if known := os.environ.get(_MODULES):
        modules.SHIPPED = Path(known)  # type: ignore[misc]
    generate(
        Path(target), lowered_modules() if _LOWER in options else chain(lowered_modules(), compiled_code())
    )
