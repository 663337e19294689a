"""The damping study: what backstops and packs of other materials would buy.

"Passive damping methods should be improved, probably requiring a breakthrough in materials", F. Hendriks, IBM
J. Res. Develop. 27 (1983), discussion. Here materials are exchanged one at a time, the print force being
kept: the amplitude of the waveform is set anew so that the single pulse prints as hard as before. Then the
hammer is fired once and watched until it settles, and its safe rate is looked for.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.drive.input import read_positive
from printhammer.errors import InputError
from printhammer.printing.dots.limits import Limits
from printhammer.printing.dots.nominal import nominal, pulse_of, single_pulses
from printhammer.printing.dots.settling import settle
from printhammer.printing.rates.materials import Material, materials
from printhammer.printing.rates.perturbation import changed
from printhammer.printing.rates.safe_rate import FIRST, LAST, rate_grid
from printhammer.printing.rates.safe_rates import safe_rates
from printhammer.run.ensemble import DISPLAY_TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt
    import xarray as xr

    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.dots.nominal import Nominal
    from printhammer.support.arrays import FloatArray
    from printhammer.support.threads import Progress

CURRENT: Final = 2.0
"""Largest current, A, unless told otherwise."""

STEP: Final = 25.0
"""Step of the grid of rates, Hz, unless told otherwise."""

LEAST: Final = 0.6
MOST: Final = 1.6
"""Factors on the amplitude between which the one that prints as hard is looked for."""

_COARSE: Final = 41
_FINE: Final = 9
_ROUNDS: Final = 5


@dataclass(frozen=True)
class DampingStudy:
    """What other materials do at the same print force: arrays of shape (N,), one entry for each material.

    Attributes
    ----------
    hammer : Hammer
        The hammer that is studied.
    limits : Limits
        How far a dot may be off, for the safe rates.
    current_limit : float
        Largest current allowed, A.
    nominal : Nominal
        Single-pulse dot of the hammer; its force is kept.
    materials : tuple of Material
        What is exchanged.
    status : str array
        "ok"; "current limit" where the print force takes more current than is allowed (the numbers are those
        with that current all the same); or "no hammer", "does not rest", "force not reached", or how the run
        ended: then the numbers are NaN.
    amplitude : array
        Factor on the amplitude of the waveform.
    peak_current : array
        Largest absolute value of the waveform, A.
    force : array
        Single-pulse force, N.
    flight_time : array
        Single-pulse flight time, s.
    settle_out : array
        Time from the firing until the armature stays within a hundredth of the stroke from rest, s; NaN where
        it does not within 20 ms.
    rebounds : array
        Number of rebounds higher than a hundredth of the stroke.
    highest : array
        Highest rebound, in parts of the stroke.
    restitution : array
        Speed after the first touch of the backstop over the speed before; 0 where the armature does not
        leave.
    impulse : array
        Change of momentum at the backstop after a single pulse, N s.
    loss : array
        Energy that the backstop takes after a single pulse, J.
    backstop_force : array
        Largest backstop force, N.
    coil_work : array
        Net work of the coil in a single pulse, J.
    safe_rate : array
        Safe rate, Hz; NaN where not even the first rate of the grid passes.
    grid : array
        Rates that were tried, Hz.
    tolerance : float
        Of the integration, settling excepted.
    """

    hammer: Hammer
    limits: Limits
    current_limit: float
    nominal: Nominal
    materials: tuple[Material, ...]
    status: npt.NDArray[np.str_] = field(repr=False)
    amplitude: FloatArray = field(repr=False)
    peak_current: FloatArray = field(repr=False)
    force: FloatArray = field(repr=False)
    flight_time: FloatArray = field(repr=False)
    settle_out: FloatArray = field(repr=False)
    rebounds: FloatArray = field(repr=False)
    highest: FloatArray = field(repr=False)
    restitution: FloatArray = field(repr=False)
    impulse: FloatArray = field(repr=False)
    loss: FloatArray = field(repr=False)
    backstop_force: FloatArray = field(repr=False)
    coil_work: FloatArray = field(repr=False)
    safe_rate: FloatArray = field(repr=False)
    grid: FloatArray = field(repr=False)
    tolerance: float

    @property
    def best(self) -> int | None:
        """Number of the material with the highest safe rate within the current limit; None without any."""
        allowed = np.where((self.status == "ok") & ~np.isnan(self.safe_rate), self.safe_rate, -np.inf)
        return int(np.argmax(allowed)) if np.isfinite(allowed).any() else None

    def to_dataset(self) -> xr.Dataset:
        """Return the materials as a Dataset over `material`, with units and provenance in the attributes."""
        from printhammer.printing.rates.study_tables import damping_dataset

        return damping_dataset(self)

    def plot(self, **options: Any) -> Any:
        """Draw what each material buys; returns a matplotlib figure."""
        # By name, so that physics does not depend on pictures.
        return import_module("printhammer.figures.printing.damping").plot(self, **options)


def damping_study(
    hammer: Hammer,
    others: Sequence[Material] | None = None,
    *,
    current: float | str = CURRENT,
    limits: Limits | None = None,
    first: float | str = FIRST,
    last: float | str = LAST,
    step: float | str = STEP,
    tolerance: float = DISPLAY_TOLERANCE,
    threads: int | None = None,
    progress: Progress | None = None,
) -> DampingStudy:
    """Exchange the materials of backstop and pack, and see what settles sooner and prints faster.

    Parameters
    ----------
    hammer : Hammer
        The hammer that is studied, with pack, backstop and waveform.
    others : sequence of Material, optional
        What is exchanged; by default those of `printhammer.printing.rates.materials.materials`.
    current : float or str, optional
        Largest current allowed, A, or text with a unit.
    limits : Limits, optional
        How far a dot may be off, for the safe rates; by default 10 % of the force, 50 us, no extra contacts.
    first, last, step : float or str, optional
        The grid of rates, Hz.
    tolerance : float, optional
        As for `printhammer.simulate`, of print forces and safe rates; by default that for pictures. Settling
        is always computed with the default one of `printhammer.simulate`.
    threads : int, optional
        By default as many as there are cores; the result does not depend on it.
    progress : callable, optional
        Called now and then with the number of materials done and of all.

    Returns
    -------
    DampingStudy
        With a status for each material.

    Raises
    ------
    InputError
        An argument is not what is described above; a hammer without a backstop, or whose single pulse makes
        no dot; a waveform that is a force.
    """
    allowed = read_positive(current, "A", "current")
    grid = rate_grid(first, last, step)
    bounds = Limits() if limits is None else limits
    if hammer.backstop is None:
        raise InputError(f"{hammer.path}: the hammer has no backstop, expected one of some material")
    pulse = pulse_of(hammer)
    if pulse.quantity != "current":
        raise InputError(f"{hammer.path}: the waveform is a force, expected a current")
    single = nominal(hammer, tolerance=tolerance)
    tried = tuple(materials(hammer, single) if others is None else others)
    if not tried:
        raise InputError("others: expected at least one material")
    made, fate = changed(hammer, [(material.changes, material.label) for material in tried])
    status = np.array(fate, "U17")
    values = {name: np.full(len(tried), np.nan) for name in _COLUMNS}
    resting = np.flatnonzero(status == "ok")
    factors = tuned([made[k] for k in resting], single.force, tolerance=tolerance, threads=threads)
    values["amplitude"][resting] = factors
    status[resting[np.isnan(factors)]] = "force not reached"
    values["peak_current"] = pulse.peak * values["amplitude"]
    left = np.flatnonzero(status == "ok")
    driven = [_driven(made[k], values["amplitude"][k]) for k in left]
    dots = single_pulses(driven, tolerance=tolerance, threads=threads)
    for k, one, dot in zip(left.tolist(), driven, dots, strict=True):
        # At the default tolerance: energies of single runs are not worth a risk.
        settling = settle(one)
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
    values["safe_rate"][left[run]] = safe_rates(
        [driven[n] for n in run],
        [dot for n in run if (dot := dots[n]) is not None],
        grid,
        limits=bounds,
        tolerance=tolerance,
        threads=threads,
        progress=progress,
    )
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
        tolerance=tolerance,
    )


_COLUMNS: Final = (
    "amplitude",
    "peak_current",
    "force",
    "flight_time",
    "settle_out",
    "rebounds",
    "highest",
    "restitution",
    "impulse",
    "loss",
    "backstop_force",
    "coil_work",
    "safe_rate",
)


def tuned(
    hammers: Sequence[Hammer], force: float, *, tolerance: float, threads: int | None = None
) -> FloatArray:
    """Return factors on the amplitudes of waveforms with which single pulses print with a force.

    The factor is looked for from `LEAST` to `MOST` on a grid, then on ever finer ones: where the force first
    rises through that wanted, of several such places the one nearest to 1.

    Parameters
    ----------
    hammers : sequence of Hammer
        Hammers that rest.
    force : float
        Force wanted, N.
    tolerance, threads
        As for `printhammer.printing.dots.nominal.single_pulses`.

    Returns
    -------
    array, shape (hammers,)
        NaN where there is none; good to 1e-6.
    """
    scales = np.tile(np.linspace(LEAST, MOST, _COARSE), (len(hammers), 1))
    found = np.full(len(hammers), np.nan)
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
            tolerance=tolerance,
            threads=threads,
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
            found[alive] = low + (high - low) * (force - below) / (above - below)
        scales = np.linspace(low, high, _FINE, axis=1)
    return found


def _driven(hammer: Hammer, factor: float) -> Hammer:
    """Return the hammer with its waveform a factor larger."""
    return hammer.replace("waveform", pulse_of(hammer).scaled(float(factor)), source="the same print force")
