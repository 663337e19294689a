"""Damping study: safe rate and settling with other backstop and pack materials.

"Passive damping methods should be improved, probably requiring a breakthrough in materials", F. Hendriks, IBM
J. Res. Develop. 27 (1983), discussion. The study replaces one material at a time at constant print force: the
amplitude of the waveform is adjusted so that the single pulse prints as hard as before. Then the hammer is
fired once and simulated until it settles, and its safe rate is computed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final, Unpack

import numpy as np

from printhammer.drive.input import read_positive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.parts.backstop.elastomer import ElastomerBackstop
from printhammer.parts.backstop.hertz import HertzBackstop
from printhammer.parts.pack.dashpot import DashpotPack
from printhammer.parts.pack.power import PowerPack
from printhammer.printing.dots.judging import Limits
from printhammer.printing.dots.nominal import Nominal, nominal, pulse_of, single_pulses
from printhammer.printing.dots.settling import settle
from printhammer.printing.rates.safe_rate import grid_notes, grid_of, safe_rates
from printhammer.printing.rates.variability import changed
from printhammer.results import Declared, Result, column, derived, part, scalar
from printhammer.results.declare import columns_of
from printhammer.results.summary import (
    Cells,
    Grid,
    Summary,
    styled,
)
from printhammer.run.effort import DISPLAY, Effort, Keywords, computation
from printhammer.support.arrays import FloatArray, TextArray

KINDS: Final = ("as it is", "hard", "elastomer", "pack")
"""Kinds of material: as built, hard backstop with changed constants, elastomer backstop, changed pack."""

STIFFNESSES: Final = (1.0 / 9.0, 1.0 / 3.0, 3.0)
"""Factors on the stiffness of a hard backstop; arbitrary."""
DAMPINGS: Final = (0.25, 0.5, 2.0, 4.0, 16.0)
"""Factors on the damping of a hard backstop; arbitrary."""

ELASTOMERS: Final = (8e7, 8e8)
"""Stiffnesses of the elastomers, N/m^1.5: about as in the paper (10 N at 25 um), and ten times as much."""

RELAXATIONS: Final = (0.0, 10e-6, 30e-6, 100e-6, 300e-6)  # Relaxation times of the elastomers, s; arbitrary

PACKS: Final = (0.5, 2.0)  # Factors on the stiffness of the pack; arbitrary

PACK_DAMPINGS: Final = (0.1, 0.4)  # Damping ratios of spring-and-dashpot packs; arbitrary


class Material(Declared):
    """Replacement material for the backstop or the pack of the studied hammer."""

    kind: str = part("one of `KINDS`")
    label: str = part("short description of the material")
    changes: Mapping[str, Any] = part("constants, options and parts to replace, as for `Hammer.replace`")

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(
                f"kind = {self.kind!r} of a material",
                key="kind",
                value=self.kind,
                expected=f"one of {', '.join(KINDS)}",
            )


def materials(hammer: Hammer, single: Nominal) -> list[Material]:
    """List the default replacement materials for a hammer and its single-pulse dot.

    Hard backstops have other constants of equations (6) and (7); elastomers follow the law of Kuwabara and
    Kono; packs follow equation (5) with another stiffness, or are a spring with a dashpot. The stiffness of
    the pack's spring is such that the loading work of the single-pulse dot compresses the spring to the force
    of this dot.
    """
    listed = [Material("as it is", "as it is", {})]
    backstop, pack = hammer.backstop, hammer.pack
    hard = backstop if isinstance(backstop, HertzBackstop) else None
    if hard is not None and hard.damping is not None and hard.stiffness is not None:
        k, damping = hard.stiffness, hard.damping
        listed += [
            # The restitution depends on l v / k alone: scaling both only changes the contact time.
            Material(
                "hard", f"k and l x {f:.2g}", {"backstop.stiffness": f * k, "backstop.damping": f * damping}
            )
            for f in STIFFNESSES
        ]
        listed += [Material("hard", f"l x {f:g}", {"backstop.damping": f * damping}) for f in DAMPINGS]
    if hammer.position is not None:
        listed += [
            Material(
                "elastomer",
                f"k {1e-6 * stiffness:g} MN/m^1.5, A {1e6 * time:g} us",
                {
                    "backstop": ElastomerBackstop(
                        position=hammer.position, stiffness=stiffness, relaxation_time=time
                    )
                },
            )
            for stiffness in ELASTOMERS
            for time in RELAXATIONS
        ]
    if isinstance(pack, PowerPack):
        listed += [
            Material("pack", f"stiffness x {f:g}", {"pack.stiffness": f * pack.stiffness}) for f in PACKS
        ]
        stiff = 0.5 * single.force**2 / single.loading_work
        critical = 2.0 * math.sqrt(stiff * hammer.mass)
        listed += [
            Material(
                "pack",
                f"dashpot, {ratio:g} of critical",
                {"pack": DashpotPack(stiffness=stiff, damping=ratio * critical, front=pack.front)},
            )
            for ratio in PACK_DAMPINGS
        ]
    return listed


CURRENT: Final = 2.0  # Default current limit, A: the range of the paper's Fig. 2

STEP: Final = 25.0  # Default step of the rate grid, Hz; arbitrary

LEAST: Final = 0.6
"""Smallest amplitude factor in the search for the nominal print force; arbitrary."""
MOST: Final = 1.6
"""Largest amplitude factor in the search for the nominal print force; arbitrary."""

_COARSE: Final = 41  # Number of amplitude factors of the first grid; arbitrary
_FINE: Final = 9  # Number of amplitude factors of each refinement; arbitrary
_ROUNDS: Final = 5  # Number of refinements; arbitrary


class DampingStudy(Result):
    """Safe rate and settling of a hammer by backstop and pack material, at equal print force.

    The numbers of a material are NaN unless its `status` is "ok" or "current limit".
    """

    hammer: Hammer = part("hammer under study")
    limits: Limits = part("limits on the dots, for the safe rates")
    current_limit: float = scalar("A", "current limit")
    nominal: Nominal = part(
        "single-pulse dot of the hammer", more="the force of this dot is the print force of every material"
    )
    materials: tuple[Material, ...] = part("materials that replace those of the hammer")
    status: TextArray = column(
        "",
        "status of the material",
        "material",
        more='"ok"; "current limit" if the print force needs a current above the limit (the numbers are then'
        ' those with that current); "no hammer", "does not rest", "force not reached", or the status of the'
        " simulation",
    )
    amplitude: FloatArray = column("1", "factor on the amplitude of the waveform", "material")
    peak_current: FloatArray = column("A", "largest current", "material", more="the absolute value")
    force: FloatArray = column("N", "single-pulse force", "material")
    flight_time: FloatArray = column("s", "single-pulse flight time", "material")
    settle_out: FloatArray = column(
        "s",
        "settle-out time",
        "material",
        more="from the firing until the armature stays within a hundredth of the stroke from rest; NaN if"
        " it has not settled within 20 ms or two windows",
    )
    rebounds: FloatArray = column("1", "number of rebounds higher than a hundredth of the stroke", "material")
    highest: FloatArray = column(
        "1", "height of the highest rebound, as a fraction of the stroke", "material"
    )
    restitution: FloatArray = column(
        "1",
        "speed after the first touch of the backstop over the speed before",
        "material",
        more="0 if the armature stays on the backstop",
    )
    impulse: FloatArray = column("N s", "change of momentum at the backstop after a single pulse", "material")
    loss: FloatArray = column("J", "energy dissipated in the backstop after a single pulse", "material")
    backstop_force: FloatArray = column("N", "largest backstop force", "material")
    coil_work: FloatArray = column("J", "net work of the coil in a single pulse", "material")
    safe_rate: FloatArray = column(
        "Hz", "safe rate", "material", more="NaN if not even the first rate of the grid passes"
    )
    grid: FloatArray = part("grid of rates, Hz", repr=False)
    tolerance: float = part("error tolerance per integration step", more="except for settling")

    @property
    def title(self) -> str:
        """One-line title with the name of the studied hammer."""
        return f"damping study of {self.hammer.name}"

    def summary(self) -> Summary:
        """Tabulate settling, wear and safe rate, one row per material."""
        rates = [None if math.isnan(rate) else f"{rate:g}" for rate in self.safe_rate.tolist()]
        if self.best is not None:
            rates[self.best] = styled("best", rates[self.best])
        return Summary(
            [
                Grid(
                    [
                        Cells("", [material.kind for material in self.materials], left=True),
                        Cells("material", [m.label.replace(" us", " µs") for m in self.materials], left=True),
                        self.cells("peak_current", "current", ".3f"),
                        self.cells("settle_out", "settle-out"),
                        self.cells("rebounds", format=".0f"),
                        self.cells("restitution", "first\nrestitution", ".2f"),
                        self.cells("loss", "backstop"),
                        Cells("safe rate", rates, "Hz"),
                        Cells("", ["" if s == "ok" else styled("poor", s) for s in self.status], left=True),
                    ]
                )
            ]
        )

    def notes(self) -> dict[str, Any]:
        """Return limits, print force and rate grid, as attributes of the Dataset."""
        return {"limits": self.limits.text, "single_force": self.nominal.force, **grid_notes(self.grid)}

    @property
    @derived("", "kind of replacement", "material")
    def kind(self) -> list[str]:
        """Kind of each replacement material, from `printhammer.printing.rates.damping.KINDS`."""
        return [material.kind for material in self.materials]

    @property
    @derived("", "replacement material", "material")
    def label(self) -> list[str]:
        """Short description of each replacement material."""
        return [material.label for material in self.materials]

    @property
    def best(self) -> int | None:
        """Index of the material with the highest safe rate within the current limit, or None."""
        allowed = np.where((self.status == "ok") & ~np.isnan(self.safe_rate), self.safe_rate, -np.inf)
        return int(np.argmax(allowed)) if np.isfinite(allowed).any() else None


_NUMBERS: Final = tuple(name for name, note in columns_of(DampingStudy).items() if note.dims and note.unit)


@computation
def damping_study(
    hammer: Hammer,
    others: Sequence[Material] | None = None,
    *,
    current: float | str = CURRENT,
    limits: Limits | None = None,
    first: float | str | None = None,
    last: float | str | None = None,
    step: float | str | None = None,
    effort: Effort = DISPLAY,
    **_keywords: Unpack[Keywords],
) -> DampingStudy:
    """Replace the materials of backstop and pack, and compare settling and safe rates.

    The tolerance applies to print forces and safe rates. Settling is always computed at the default tolerance
    of `printhammer.simulate`.

    Parameters
    ----------
    hammer : Hammer
        Hammer to study, with pack, backstop and waveform.
    others : sequence of Material, optional
        Replacements; by default those of `printhammer.printing.rates.damping.materials`.
    current : float or str, optional
        Current limit, A, or text with a unit.
    limits, first, last, step
        As for `printhammer.safe_rate`.

    Returns
    -------
    DampingStudy
        The study, with a status for each material.
    """
    allowed = read_positive(current, "A", "current")
    grid = grid_of(hammer, first, last, step, STEP)[0]
    bounds = Limits() if limits is None else limits
    if hammer.backstop is None:
        raise InputError(
            f"{hammer.path}: the hammer has no backstop",
            file=hammer.path,
            key="backstop",
            expected="one of some material",
        )
    pulse = pulse_of(hammer)
    if pulse.quantity != "current":
        raise InputError(
            f"{hammer.path}: the waveform is a {pulse.quantity}",
            file=hammer.path,
            key="waveform",
            expected="a current",
        )
    single = nominal(hammer, tolerance=effort.tolerance)
    tried = tuple(materials(hammer, single) if others is None else others)
    if not tried:
        raise InputError("others: expected at least one material", key="others")
    made, fate = changed(hammer, [(material.changes, material.label) for material in tried])
    status = np.array(fate, "U17")
    values = {name: np.full(len(tried), np.nan) for name in _NUMBERS}
    resting = np.flatnonzero(status == "ok")
    factors = tuned([made[k] for k in resting], single.force, effort.quiet)
    values["amplitude"][resting] = factors
    status[resting[np.isnan(factors)]] = "force not reached"
    values["peak_current"] = pulse.peak * values["amplitude"]
    left = np.flatnonzero(status == "ok")
    driven = []
    for k, factor in zip(left.tolist(), values["amplitude"][left].tolist(), strict=True):
        larger = pulse_of(made[k]).scaled(factor)
        driven.append(made[k].replace("waveform", larger, source="the same print force"))
    dots = single_pulses(driven, effort=effort.quiet)
    for k, exchanged, dot in zip(left.tolist(), driven, dots, strict=True):
        # At the default tolerance, which the energies require; single runs are cheap.
        settling = settle(exchanged)
        wear = settling.wear
        if settling.status != "ok" or dot is None:
            status[k] = settling.status if settling.status != "ok" else "force not reached"
            continue
        for name, value in {
            "force": dot.force,
            "flight_time": dot.flight_time,
            "settle_out": settling.settle_out,
            "rebounds": float(settling.rebounds),
            "highest": settling.highest,
            "restitution": settling.restitution or 0.0,
            "impulse": wear.impulse,
            "loss": wear.loss,
            "backstop_force": wear.largest_force,
            "coil_work": settling.coil_work,
        }.items():
            values[name][k] = math.nan if value is None else value
    run = [n for n, k in enumerate(left.tolist()) if status[k] == "ok"]
    hammers, singles = [driven[n] for n in run], [dot for n in run if (dot := dots[n]) is not None]
    values["safe_rate"][left[run]] = safe_rates(hammers, singles, grid, limits=bounds, effort=effort)
    over = (status == "ok") & (values["peak_current"] > allowed)
    status[over] = "current limit"
    return DampingStudy(
        hammer=hammer,
        limits=bounds,
        current_limit=allowed,
        nominal=single,
        materials=tried,
        status=status,
        **values,
        grid=grid,
        tolerance=effort.tolerance,
    )


def tuned(hammers: Sequence[Hammer], force: float, effort: Effort) -> FloatArray:
    """Solve for the factors on the waveform amplitudes with which single pulses print with a given force, N.

    The search covers factors from `LEAST` to `MOST` on a grid, then ever finer grids around a crossing where
    the force rises through `force`; of several crossings, the crossing nearest to a factor of 1 is refined.
    Factors are accurate to 1e-6; NaN where no crossing is bracketed.
    """
    scales = np.tile(np.linspace(LEAST, MOST, _COARSE), (len(hammers), 1))
    factors = np.full(len(hammers), np.nan)
    alive = np.arange(len(hammers))
    for last in [False] * _ROUNDS + [True]:
        if not alive.size:
            break
        trials = [
            (hammers[k], scale)
            for k, row in zip(alive.tolist(), scales, strict=True)
            for scale in row.tolist()
        ]
        dots = single_pulses(
            [hammer for hammer, _ in trials],
            [pulse_of(hammer).scaled(scale) for hammer, scale in trials],
            effort=effort,
        )
        forces = np.array([0.0 if dot is None else dot.force for dot in dots]).reshape(scales.shape)
        rises = (forces[:, :-1] < force) & (forces[:, 1:] >= force)
        middle = 0.5 * (scales[:, :-1] + scales[:, 1:])
        place = np.argmin(np.where(rises, np.abs(middle - 1.0), np.inf), axis=1)
        rows = np.flatnonzero(rises.any(axis=1))
        alive, place = alive[rows], place[rows]
        low, high = scales[rows, place], scales[rows, place + 1]
        if last:
            below, above = forces[rows, place], forces[rows, place + 1]
            factors[alive] = low + (high - low) * (force - below) / (above - below)
        scales = np.linspace(low, high, _FINE, axis=1)
    return factors
