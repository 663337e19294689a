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
        from printhammer.kernel.compile.bindings import bindings_of
        from printhammer.kernel.compile.modules import Module, every_template, laws_of
        from printhammer.kernel.model.laws import LAW_FUNCTIONS, Laws
        from printhammer.parts import PARTS
        from printhammer.run import problem
        from printhammer.run.plain import entries

        folder = tempfile.TemporaryDirectory()
        atexit.register(folder.cleanup)

        def ship(module: Module) -> None:
            path = Path(folder.name, module.shipped.name)
            path.write_bytes(lzma.compress(module.content(), preset=9))
            place = module.shipped.relative_to(Path(self.root, "src"))
            build_data["force_include"][str(path)] = place.as_posix()

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
            ship(entries.page_module(problem.laws_of(hammer, drive)))
