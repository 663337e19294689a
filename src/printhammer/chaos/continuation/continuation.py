"""Continuation of a periodic orbit, stable or not, in one parameter, to the ends of its branch.

A branch is a curve of periodic orbits. Its Floquet multipliers show where and how the orbit loses stability;
its sequence of contacts shows where a contact appears or vanishes, a grazing. The contact forces of the
paper's pack and backstop begin smoothly, with the powers 2.7 and 1.5 of the depth, so that the strobe map is
differentiable at a grazing and the branch continues. With a rigid backstop the map has a kink at a grazing: a
branch ends at its first grazing, which is reported as the reason for stopping.
"""

from __future__ import annotations

from typing import Final, SupportsIndex, Unpack

import numpy as np

from printhammer.chaos.continuation.arclength import Steps
from printhammer.chaos.continuation.branch import MOST, Branch
from printhammer.chaos.continuation.tracer import PRECISION, Tracer, read_bounds
from printhammer.chaos.orbits.orbit import Orbit
from printhammer.chaos.orbits.search import orbits
from printhammer.chaos.strobe.map import MAP_EFFORT, is_on_impact, is_usable, quiet_section, state_later
from printhammer.chaos.strobe.points import strobes
from printhammer.drive.input import read_count
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.run.effort import Effort, computation
from printhammer.run.regime import Fired, Regime
from printhammer.support.arrays import FloatArray

_SETTLE: Final = 500
"""Number of firings after which a train from rest is assumed to have settled; arbitrary."""


@computation
def continuation(
    start: Hammer | Regime | Orbit,
    parameter: str,
    bounds: tuple[float | str, float | str],
    *,
    firings: SupportsIndex | None = None,
    state: tuple[float, float] | None = None,
    most: SupportsIndex = MOST,
    steps: Steps | None = None,
    effort: Effort = MAP_EFFORT,
    **firing: Unpack[Fired],
) -> Branch:
    """Follow a periodic orbit of a hammer in one parameter.

    Parameters
    ----------
    start : Hammer, Regime or Orbit
        A periodic orbit from `printhammer.orbits`; or a regime, or a hammer with the keywords `firing`. The
        starting orbit of a regime or hammer is the orbit near `state` if a state is given, else the orbit
        that a train from rest settles to, else the first orbit of a search. Where an impact lies on the
        section, the branch is followed at another phase; no result depends on the phase.
    parameter : str
        "period", "rate", or the dotted key of a constant of the hammer, such as "backstop.damping", of the
        waveform or of a continuous periodic force, such as "waveform.amplitude" or "drive.amplitude".
    bounds : tuple
        Smallest and largest value, SI or text with a unit.
    firings : int, optional
        For a hammer or regime: number of firings after which the orbit repeats; by default the period that
        the train from rest settles to, or 1 if it does not settle or a state is given.
    state : tuple of float, optional
        For a hammer or regime: displacement [m] and velocity [m/s] at a section, near the orbit.
    most : int, optional
        Maximum number of steps in each direction.
    steps : Steps, optional
        Step sizes and maximum number of steps, replacing `most`. Step sizes are distances in scaled
        variables: the state divided by the half-widths of the strobe window, and the parameter divided by a
        fifth of its range.
    **firing
        Firing of the hammer, as for `printhammer.Regime.of`; for an orbit only its phase may be given.

    Returns
    -------
    Branch
        Branch in both directions from the start, up to the bounds or to an earlier stop, with the reason.
        Folds are located to about 1e-10 of the range or better, grazings to about 1e-8.
    """
    if isinstance(start, Orbit):
        fired = [value for name, value in firing.items() if name not in ("phase", "overlap")]
        if any(value is not None for value in (*fired, state, firings)):
            raise InputError(
                "start = an orbit",
                key="orbit",
                expected="no period, rate, waveform, drive, firings or state",
            )
        if not start.ok:
            raise InputError(f"the orbit to start from is not periodic: {start.status}", key="orbit")
        regime, point, count = start.regime, np.array(start.section), start.firings
        phase = firing.get("phase")
        if phase is not None and phase != start.phase:
            raise InputError.of("phase", phase, f"that of the orbit, {start.phase!r}, or none")
    else:
        regime = Regime.of_firing(start, firing)
        ends, own = read_bounds(regime, parameter, bounds), regime.value(parameter)
        if not ends[0] <= own <= ends[1]:
            raise InputError(
                f"{parameter} = {own:.9g} {regime.quantity(parameter).si} at the start",
                key=parameter,
                value=own,
                expected=f"one within the bounds {ends[0]:.9g} to {ends[1]:.9g}",
            )
        wanted = None if firings is None else read_count(firings, "firings")
        if state is None:
            regime, point, count = _orbit_to_start_from(regime, wanted, effort)
        else:
            point, count = np.array(state, dtype=np.float64), wanted or 1
    if is_on_impact(regime, point, count, effort.tolerance):
        quiet = quiet_section(regime, point, count, effort.tolerance)
        regime, point = (regime, point) if quiet is None else quiet
    tracer = Tracer(regime, parameter, read_bounds(regime, parameter, bounds), effort.quiet)
    chosen = steps or Steps(most=read_count(most, "most"), precision=PRECISION)
    return tracer.branch(point, count, chosen, effort.progress)


def _orbit_to_start_from(
    regime: Regime, firings: int | None, effort: Effort
) -> tuple[Regime, FloatArray, int]:
    """Find the starting orbit of `firings` firings (None: any), from a train from rest or by a search.

    Returns the regime, with the phase of the section; the state of the orbit at this section; and the period
    of the orbit in firings.
    """
    judged = (_SETTLE // 2, _SETTLE)
    (settled,) = strobes(regime, points=1, transient=_SETTLE, firings=judged, threads=effort.threads)
    period = None if settled.verdict is None or not settled.ok else settled.verdict.period
    state = np.array([settled.x[0], settled.v[0]])
    if period is not None and firings in (None, period) and is_usable(regime.hammer, *state.tolist()):
        return regime, state, period
    many = firings or 1
    for orbit in orbits(regime, longest=many, threads=effort.threads):
        if orbit.firings == many:
            state = state_later(orbit.regime, orbit.section, regime.phase, effort.tolerance)
            # For an armature moving out of the pack, (x, v) is not the complete state.
            if np.isfinite(state).all() and is_usable(regime.hammer, *state.tolist()):
                return regime, state, many
            return orbit.regime, np.array(orbit.section), many
    raise InputError(
        (
            f"the train from rest at a period of {regime.period:.9g} s settles to no orbit of {many}"
            " firings, and a search finds none"
        ),
        key="state",
        expected="a state or an orbit to start from",
    )
