"""Print heads: where the wires are, how thick they are, and how dark a dot of theirs is.

The paper says of the head only that its wires are arranged in columns and that the carriage moves a fraction
of a metre per second. The numbers here are assumptions in the manner of the heads of the time: nine wires
1/72 in apart and about as thick as that, columns of dots 1/60 in apart, so that a character of six columns
takes a tenth of an inch; 18 and 24 wires on the same height, thinner.
"""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Final

from printhammer.errors import InputError
from printhammer.results import Declared, part, scalar

DENSITY: Final = 1.0
"""Optical density of the dot of a single pulse, an assumption: a tenth of the light comes back."""

_THICKNESS: Final = 4 / 3
_HEIGHT: Final = 9 * 25.4e-3 / 72
LINE_GAP: Final = 1 / 3
"""Between print lines, in parts of the height of the wires."""


class Head(Declared):
    """A print head: one column of wires on a carriage."""

    wires: int = part("number of wires")
    wire_pitch: float = scalar("m", "from wire to wire")
    pitch: float = scalar(
        "m", "from one column of dots to the next", more="carriage speed = rate of slots x pitch"
    )
    wire_diameter: float = scalar("m", "also that of a dot")
    density: float = part("optical density of the dot of a single pulse", default=DENSITY)
    line_gap: float = part(
        "between print lines, in parts of the height of the wires",
        more="0 for drawings that go on from line to line",
        default=LINE_GAP,
    )

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            least = 0.0 if entry.name == "line_gap" else math.ulp(0.0)
            if isinstance(value, bool) or not (value >= least and math.isfinite(value)):
                expected = "a positive number" if least else "a number not below 0"
                raise InputError.of(entry.name, value, expected, file="head")

    @property
    def line_pitch(self) -> float:
        """From print line to print line, m: the height of the wires, and the gap."""
        return (1.0 + self.line_gap) * self.wires * self.wire_pitch


_STANDARD: Final = {
    9: Head(9, _HEIGHT / 9, 25.4e-3 / 60, 0.35e-3),
    18: Head(18, _HEIGHT / 18, _HEIGHT / 18, 0.25e-3),
    24: Head(24, _HEIGHT / 24, _HEIGHT / 24, 0.2e-3),
}


def head_of(
    wires: int,
    *,
    pitch: float | None = None,
    wire_diameter: float | None = None,
    density: float = DENSITY,
    line_gap: float = LINE_GAP,
) -> Head:
    """Return a head of an assumed kind: as high as that of nine wires, whatever their number.

    Parameters
    ----------
    wires, density, line_gap
        As for `Head`.
    pitch : float, optional
        From slot to slot, m; by default 1/60 in for 9 wires, else as from wire to wire.
    wire_diameter : float, optional
        Thickness of the wires, m; by default 0.35, 0.25 and 0.2 mm for 9, 18 and 24 wires, else a third more
        than from wire to wire.
    """
    if wires < 1:
        raise InputError.of("wires", wires, "a positive number", file="head")
    apart = _HEIGHT / wires
    usual = _STANDARD.get(wires, Head(wires, apart, apart, _THICKNESS * apart))
    return Head(
        wires,
        usual.wire_pitch,
        usual.pitch if pitch is None else pitch,
        usual.wire_diameter if wire_diameter is None else wire_diameter,
        density,
        line_gap,
    )
