"""Controllers with coarse tables. Helpers only.

The tables of `GRIDS` are computed in half a second. Their controller prints poorly, but its tables must agree
with runs, and it must respect its limits. The controller of `HALVED` prints as well as the default requires.
"""

import functools
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import printhammer as ph
from printhammer.control.feedback import impact_map, soft_landing
from printhammer.control.feedback.controller import Controller
from printhammer.control.feedback.impact_map import ForceMap, ImpactMap
from printhammer.control.feedback.plant import Plant, driver_of
from printhammer.control.feedback.soft_landing import Launch
from printhammer.printing.dots.nominal import nominal

HAMMER = Path(__file__).parents[2] / "data" / "bucked.toml"

STARTS, WIDTHS, NEAR = np.linspace(0.85, 1.75, 4), np.linspace(0.1, 0.75, 3), np.linspace(-1.0, 1.0, 3)
"""Brake pulses of the first grid, and grid about the best."""


GRIDS = {
    impact_map: {
        "_PUSHED_SPEEDS": np.linspace(0.3, 1.1, 3),
        "_FREE_SPEEDS": np.linspace(0.6, 1.25, 3),
        "_RELEASES": np.linspace(0.0, 0.85, 8),
        "_EARLY": np.linspace(0.14, 1.07, 5),
        "_LATE": np.linspace(1.1, 2.9, 5),
    },
    soft_landing: {"_STARTS": STARTS, "_WIDTHS": WIDTHS, "_NEAR": NEAR},
}
"""Coarse grids of every table of the controller."""

HALVED = {
    impact_map: {"_EARLY": np.linspace(0.14, 1.07, 19), "_LATE": np.linspace(1.1, 2.9, 24)},
    soft_landing: {
        "_STARTS": np.linspace(0.85, 1.75, 14),
        "_WIDTHS": np.linspace(0.1, 0.75, 10),
        "_FINER": (0.07, 0.023, 0.0077),
    },
}
"""Half the numbers of throws and of brake pulses; `docs/measure/feedback.py` measures the defaults."""


@contextmanager
def patched(grids: Mapping[ModuleType, Mapping[str, Any]]) -> Iterator[None]:
    """Replace grids of the controller's tables."""
    with pytest.MonkeyPatch.context() as patch:
        for module, values in grids.items():
            for name, value in values.items():
                patch.setattr(module, name, value)
        yield


@functools.cache
def plant() -> Plant:
    """A hammer with a driver that nearly cancels the field of its magnet."""
    hammer = ph.load(HAMMER)
    return Plant(hammer, driver_of(hammer), nominal(hammer), 1)


@functools.cache
def tables() -> tuple[ForceMap, Launch, ImpactMap]:
    """Return force map, launch and impact map of the nominal hammer."""
    with patched(GRIDS):
        forces = impact_map.force_map(plant())
        start = soft_landing.launch(plant(), forces)
        return forces, start, impact_map.impact_map(plant(), forces, start.width)


@functools.cache
def controller() -> Controller:
    """Return the controller of the nominal hammer."""
    with patched(GRIDS):
        return Controller(plant().hammer, plant().driver, threads=1)
