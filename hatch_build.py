"""Build hook of the wheel: adds the kernel's modules, lowered and compressed (see decision 0026)."""

from __future__ import annotations

import atexit
import lzma
import sys
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

_ABSENT = {"magnet": "", "spring": "", "pack": "", "backstop": "", "absent": "printhammer.parts.absent"}


class LoweredModules(BuildHookInterface[Any]):
    """Build hook that lowers all entry-point templates and the laws of all shipped parts into the wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the lowered modules to the wheel; an editable installation lowers modules on demand instead."""
        if version == "editable":
            return
        sys.path.insert(0, str(Path(self.root, "src")))
        from numba import TypingError

        from printhammer.drive.trains import PulseTrain, SineForce
        from printhammer.hammer.hammer import load, shipped
        from printhammer.kernel.compile import link
        from printhammer.kernel.compile.bindings import bindings_of
        from printhammer.kernel.compile.cache import sealed
        from printhammer.kernel.compile.lanes import specialise_lanes, suits
        from printhammer.kernel.compile.modules import Module, every_template, laws_of
        from printhammer.kernel.compile.specialise import specialise, variational
        from printhammer.kernel.model.laws import LAW_FUNCTIONS, Laws
        from printhammer.parts import PARTS
        from printhammer.run import problem
        from printhammer.run.ensemble_group import closed_form
        from printhammer.run.plain import entries

        folder = tempfile.TemporaryDirectory()
        atexit.register(folder.cleanup)

        def add(shipped: Path, content: bytes) -> None:
            path = Path(folder.name, shipped.name)
            path.write_bytes(content)
            build_data["force_include"][str(path)] = shipped.relative_to(Path(self.root, "src")).as_posix()

        def ship(module: Module) -> None:
            add(module.shipped, lzma.compress(module.content(), preset=9))

        for template in (*every_template(), *entries.templates()):
            ship(template)
        for role in LAW_FUNCTIONS:
            parts = {part.__module__ for (known, _), part in PARTS.items() if known == role}
            for name in ("", *sorted(parts)):
                bindings = bindings_of(Laws(**{**_ABSENT, role: name}))
                ship(laws_of(role, bindings, False))
                # A law of more constants than a lane has room for never runs in lanes.
                with suppress(TypingError):
                    ship(laws_of(role, bindings, True))
        for hammer in map(load, shipped()):
            # A textbook oscillator has no pulse of its own, and is driven by a force.
            drive = PulseTrain(hammer.waveform) if hammer.waveform else SineForce(1.0, 1.0)
            laws = problem.laws_of(hammer, drive)
            ship(entries.page_module(laws))
            kernel = specialise(laws)
            _rates, kinds = closed_form(drive.kernel_arrays()[2])
            kernels = [kernel, variational(kernel, forced=False), variational(kernel, forced=True)]
            if suits(laws) and kinds is not None:
                kernels.append(specialise_lanes(laws, kinds))
            for entry in (entry for each in kernels for entry in each.entries):
                # Processors of the level COMMON share their machine code; that of others runs nowhere else.
                if link.processor()[1] == link.COMMON:
                    add(entry.code.shipped, sealed(entry.code.get(entry.machine_code)))
