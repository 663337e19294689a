"""The damping study: what backstops and packs of other materials would buy.

"Passive damping methods should be improved, probably requiring a breakthrough in materials", F. Hendriks, IBM
J. Res. Develop. 27 (1983), discussion. Here materials are exchanged one at a time, the print force being
kept: the amplitude of the waveform is set anew so that the single pulse prints as hard as before. Then the
hammer is fired once and watched until it settles, and its safe rate is looked for.

Backstops and packs of other materials, for the damping study.
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
from printhammer.printing.rates.safe_rate import FIRST, LAST, grid_notes, rate_grid, safe_rates
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
"""What may be changed: nothing, the constants of the hard backstop, the backstop for an elastomer, the
pack."""

STIFFNESSES: Final = (1.0 / 9.0, 1.0 / 3.0, 3.0)
DAMPINGS: Final = (0.25, 0.5, 2.0, 4.0, 16.0)
"""Factors on stiffness and damping of a hard backstop."""

ELASTOMERS: Final = (8e7, 8e8)
"""Stiffness of the elastomers, N/m^1.5: 10 N at 25 um, about what the paper says of them, and ten times
that."""

RELAXATIONS: Final = (0.0, 10e-6, 30e-6, 100e-6, 300e-6)  # Relaxation times of the elastomers, s

PACKS: Final = (0.5, 2.0)  # Factors on the stiffness of the pack

PACK_DAMPINGS: Final = (0.1, 0.4)  # Damping ratios of packs of a spring and a dashpot


class Material(Declared):
    """What is other than in the hammer that is studied."""

    kind: str = part("one of `KINDS`")
    label: str = part("what it is, in a few words")
    changes: Mapping[str, Any] = part("constants, options and parts as `Hammer.replace` takes them")

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(
                f"kind = {self.kind!r} of a material",
                key="kind",
                value=self.kind,
                expected=f"one of {', '.join(KINDS)}",
            )


def materials(hammer: Hammer, single: Nominal) -> list[Material]:
    """List the materials that are studied for a hammer, and its single-pulse dot, unless others are given.

    Hard backstops have other constants of equations (6) and (7); elastomers are after Kuwabara and Kono;
    packs are softer and harder ones of equation (5), and springs with a dashpot, the spring such that the
    loading work of the single-pulse dot presses it with the force of that dot.
    """
    listed = [Material("as it is", "as it is", {})]
    backstop, pack = hammer.backstop, hammer.pack
    hard = backstop if isinstance(backstop, HertzBackstop) else None
    if hard is not None and hard.damping is not None and hard.stiffness is not None:
        k, damping = hard.stiffness, hard.damping
        listed += [
            # The rebound depends on l v / k alone: with both a factor larger, only the duration changes.
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


CURRENT: Final = 2.0  # Largest current by default, A

STEP: Final = 25.0  # Step of the grid of rates by default, Hz

LEAST: Final = 0.6
MOST: Final = 1.6
"""Factors on the amplitude between which the one that prints as hard is looked for."""

_COARSE: Final = 41
_FINE: Final = 9
_ROUNDS: Final = 5


class DampingStudy(Result):
    """What other materials do at the same print force.

    Where `status` is neither "ok" nor "current limit", the numbers are NaN.
    """

    hammer: Hammer = part("the hammer that is studied")
    limits: Limits = part("how far a dot may be off, for the safe rates")
    current_limit: float = scalar("A", "largest current allowed")
    nominal: Nominal = part("single-pulse dot of the hammer", more="its force is kept")
    materials: tuple[Material, ...] = part("what is exchanged")
    status: TextArray = column(
        "",
        "what became of it",
        "material",
        more='"ok"; "current limit" where the print force takes more current than is allowed (the numbers'
        ' are those with that current all the same); "no hammer", "does not rest", "force not reached", or'
        " how the run ended",
    )
    amplitude: FloatArray = column("1", "factor on the amplitude of the waveform", "material")
    peak_current: FloatArray = column("A", "largest current", "material", more="the absolute value")
    force: FloatArray = column("N", "single-pulse force", "material")
    flight_time: FloatArray = column("s", "single-pulse flight time", "material")
    settle_out: FloatArray = column(
        "s",
        "settle-out time",
        "material",
        more="from the firing until the armature stays within a hundredth of the stroke from rest; NaN where"
        " it does not within 20 ms or two windows of its runs",
    )
    rebounds: FloatArray = column("1", "rebounds higher than a hundredth of the stroke", "material")
    highest: FloatArray = column("1", "highest rebound, in parts of the stroke", "material")
    restitution: FloatArray = column(
        "1",
        "speed after the first touch of the backstop over the speed before",
        "material",
        more="0 where the armature does not leave",
    )
    impulse: FloatArray = column("N s", "change of momentum at the backstop after a single pulse", "material")
    loss: FloatArray = column("J", "energy that the backstop takes after a single pulse", "material")
    backstop_force: FloatArray = column("N", "largest backstop force", "material")
    coil_work: FloatArray = column("J", "net work of the coil in a single pulse", "material")
    safe_rate: FloatArray = column(
        "Hz", "safe rate", "material", more="NaN where not even the first rate of the grid passes"
    )
    grid: FloatArray = part("rates that were tried, Hz", repr=False)
    tolerance: float = part("error allowed in one step of the integration", more="settling excepted")

    @property
    def title(self) -> str:
        """What it is, in a line."""
        return f"damping study of {self.hammer.name}"

    def summary(self) -> Summary:
        """Return the materials, a row each."""
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
        """Return limits, print force and the grid of rates."""
        return {"limits": self.limits.text, "single_force": self.nominal.force, **grid_notes(self.grid)}

    @property
    @derived("", "what is exchanged", "material")
    def kind(self) -> list[str]:
        """What is exchanged, one of `printhammer.printing.rates.damping.KINDS` each."""
        return [material.kind for material in self.materials]

    @property
    @derived("", "for what", "material")
    def label(self) -> list[str]:
        """For what it is exchanged, in a few words each."""
        return [material.label for material in self.materials]

    @property
    def best(self) -> int | None:
        """Number of the material with the highest safe rate within the current limit; None without any."""
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
    first: float | str = FIRST,
    last: float | str = LAST,
    step: float | str = STEP,
    effort: Effort = DISPLAY,
    **_keywords: Unpack[Keywords],
) -> DampingStudy:
    """Exchange the materials of backstop and pack, and see what settles sooner and prints faster.

    The tolerance is that of print forces and safe rates. Settling is always computed at the default tolerance
    of `printhammer.simulate`.

    Parameters
    ----------
    hammer : Hammer
        The hammer that is studied, with pack, backstop and waveform.
    others : sequence of Material, optional
        What is exchanged; by default those of `printhammer.printing.rates.damping.materials`.
    current : float or str, optional
        Largest current allowed, A, or text with a unit.
    limits, first, last, step
        As for `printhammer.safe_rate`.

    Returns
    -------
    DampingStudy
        With a status for each material.
    """
    allowed = read_positive(current, "A", "current")
    grid = rate_grid(first, last, step)
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
        # At the default tolerance: energies of single runs are not worth a risk.
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
    """Return factors on the amplitudes of waveforms with which single pulses print with a force.

    The factor is looked for from `LEAST` to `MOST` on a grid, then on ever finer ones: where the force first
    rises through that wanted, of several such places the one nearest to 1. It is good to 1e-6; NaN where
    there is none.
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
