"""BifurcationCurve: where in the plane of two constants an orbit bifurcates, and where two things meet."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.drive.input import read_number
from printhammer.errors import InputError
from printhammer.results import Column, Result, column, derived, part, provenance, scalar

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    from printhammer.chaos.continuation.arclength import Stop
    from printhammer.chaos.curves.codimension import CodimensionTwo
    from printhammer.chaos.curves.systems import Place
    from printhammer.run.regime import Regime
    from printhammer.support.arrays import BoolArray, FloatArray, IntArray

SAME: Final = 1e-3
"""Distance of a multiplier from the unit circle within which it counts as on it."""


class BifurcationCurve(Result, rows="point"):
    """A curve in the plane of two constants on which a periodic orbit bifurcates.

    Every array has a row for each point, in order along the curve.
    """

    regime: Regime = part("hammer and periodic drive at the start")
    kind: str = scalar("", '"fold", "period doubling", "Neimark-Sacker" or "grazing"')
    surface: str = scalar("", 'of a grazing: "pack" or "backstop"; else empty')
    names: tuple[str, str] = scalar("", "the two constants")
    units: tuple[str, str] = scalar("", "their SI units")
    bounds: tuple[tuple[float, float], tuple[float, float]] = scalar("SI", "their ranges")
    firings: int = scalar("1", "number of firings after which the orbits repeat")
    tolerance: float = part("tolerance of the integration")
    first: FloatArray = column("SI", "the first constant", "point")
    second: FloatArray = column("SI", "the second constant", "point")
    state: FloatArray = part("displacement, m, and velocity, m/s, at the section, shape (N, 2)", repr=False)
    phase: FloatArray = column(
        "1", "part of the period from a firing to the section", "point", more="at a grazing: to the touch"
    )
    multipliers: npt.NDArray[np.complex128] = part(
        "Floquet multipliers, the larger absolute value first",
        more="shape (N, 2); at a grazing those of the orbit without the touch",
        repr=False,
    )
    coefficient: FloatArray = column(
        "SI",
        "coefficient of the normal form",
        "point",
        more="of a period doubling without unit, positive where it is supercritical; of a grazing of a rigid"
        " backstop that of the square root, m^(1/2)/s; nan where there is none or it is not known",
    )
    sides: IntArray = column(
        "1",
        "side of a grazing of a rigid backstop on which orbits exist",
        "point orbit",
        more="without the touch, then with one touch in 1, 2, 3 and 4 of its periods: 1 for larger values of"
        " the first constant, -1 for smaller ones, 0 for neither",
        dtype=np.int32,
    )
    contacts: tuple[str, ...] = part(
        "sequence of the contacts of each orbit, P for the pack and B for the backstop", repr=False
    )
    points: tuple[CodimensionTwo, ...] = part("points of codimension two, in order along the curve")
    stops: tuple[Stop, Stop] = part("why and where the curve ends", repr=False)
    grid: tuple[FloatArray, FloatArray] = part(
        "values of the two constants, shapes (m,) and (n,), at which trains from rest were judged", repr=False
    )
    crossings: Callable[[int, float], list[Place]] = part(
        "solves for the places at which the curve passes a value of the first or second constant", repr=False
    )
    settled: IntArray = column(
        "1",
        "firings after which the train from rest repeats",
        "value main",
        more="0 where it does not within the firings given to it, -1 where its run stopped",
        dtype=np.int32,
    )

    def __len__(self) -> int:
        return len(self.first)

    @property
    def title(self) -> str:
        """One line that says what the curve is."""
        return f"{self.kind} of period-{self.firings} orbits of {self.regime.hammer.name}"

    @property
    @derived("1", "whether stability is lost, the other multiplier being inside the unit circle", "point")
    def limits(self) -> BoolArray:
        """Whether the other multiplier lies inside the unit circle, so that stability is lost, shape (N,)."""
        if self.kind == "grazing":
            return np.asarray(np.abs(self.multipliers).max(axis=1) < 1.0)
        return np.asarray(np.abs(self.multipliers).max(axis=1) < 1.0 + SAME)

    @property
    def criticality(self) -> tuple[str, ...]:
        """Of a period doubling at each point: "supercritical", "subcritical" or, not known, ""."""
        if self.kind != "period doubling":
            return ("",) * len(self)
        words = {1.0: "supercritical", -1.0: "subcritical"}
        return tuple(words.get(float(sign), "") for sign in np.sign(self.coefficient))

    @property
    def message(self) -> str:
        """What the curve is, what happens on it, and why it ends, in one line."""
        count = len(self)
        spans = " and ".join(
            f"{name} from {values.min():.9g} to {values.max():.9g} {unit}".removesuffix(" 1")
            for name, values, unit in zip(self.names, (self.first, self.second), self.units, strict=True)
        )
        what = f"{self.kind} of the period-{self.firings} orbit, {count} points, {spans}"
        words = Counter(word for word in self.criticality if word)
        kinds = [f"{word} at {number} of {count}" for word, number in words.items()]
        kinds += [f"{point.message} at ({point.first:.9g}, {point.second:.9g})" for point in self.points]
        ends = [
            f"at its {name} point {stop.sentence}"
            for name, stop in zip(("first", "last"), self.stops, strict=True)
        ]
        if self.stops[0].reason == "closed":
            ends = ["a closed loop"]
        return "; ".join([what, *kinds, *ends])

    @property
    def provenance(self) -> dict[str, Any]:
        """Where the curve comes from."""
        regime = self.regime
        return provenance(
            hammer=regime.hammer,
            waveform=regime.fired,
            overlap=regime.overlap,
            period=regime.period,
            tolerance=self.tolerance,
        )

    def at(self, name: str, value: float | str) -> list[tuple[float, float]]:
        """Return both constants where the curve passes a value of one of them, solved for anew.

        Parameters
        ----------
        name : str
            One of the two constants.
        value : float or str
            SI or text with a unit.

        Raises
        ------
        InputError
            It is none of the two, or no number.
        """
        if name not in self.names:
            raise InputError(f"name = {name!r}, expected {self.names[0]} or {self.names[1]}")
        which = self.names.index(name)
        level = read_number(value, self.units[which], name)
        return [(place.first, place.second) for place in self.crossings(which, level)]

    def notes(self) -> dict[str, Any]:
        """Return how the curve ends, and the points of codimension two, for the attributes of the Dataset."""
        first, last = (stop.sentence for stop in self.stops)
        return {
            "first_end": first,
            "last_end": last,
            "codimension_two": [[point.message, point.first, point.second] for point in self.points],
        }

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return the points over `point`, and trains from rest over `value` and `main`."""
        own = super().entries()
        for k, (name, axis) in enumerate((("first", "main"), ("second", "value"))):
            own[name] = Column(self.units[k], self.names[k], ("point",), name=name), getattr(self, name)
            note = Column(self.units[k], self.names[k], (axis,), "coordinate", name=axis)
            # A dimension of length 0 has another meaning in the classic NetCDF format.
            own[axis] = note, self.grid[k] if self.settled.size else np.full(1, np.nan)
        if not self.settled.size:
            own["settled"] = own["settled"][0], np.full((1, 1), -1)
        for k, (name, unit, meaning) in enumerate((("x", "m", "displacement"), ("v", "m/s", "velocity"))):
            own[name] = Column(unit, f"{meaning} at the section", ("point",), name=name), self.state[:, k]
        for name in ("real", "imag"):
            pair = ("point", "multiplier")
            note = Column("1", f"{name} part of the multipliers", pair, name=f"multiplier_{name}")
            own[note.name] = note, getattr(self.multipliers, name)
        own["contacts"] = (
            Column("", "sequence of the contacts", ("point",), name="contacts"),
            np.array(self.contacts),
        )
        return own
