"""The curve of a bifurcation in the plane of two constants, from an event of a branch or a saved curve."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, SupportsIndex

import numpy as np

from printhammer.chaos.continuation.arclength import Steps
from printhammer.chaos.continuation.tracer import read_bounds
from printhammer.chaos.curves.attractors import settled_plane
from printhammer.chaos.curves.curve import BifurcationCurve
from printhammer.chaos.curves.normal_forms import MOST_PERIODS, grazing_sides, root_coefficient
from printhammer.chaos.curves.starts import start_of
from printhammer.chaos.curves.systems import GRAZING, Plane, check_two
from printhammer.chaos.curves.tracing import PRECISION, CurveTracer, Traced
from printhammer.drive.input import read_count
from printhammer.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from printhammer.chaos.continuation.branch import Branch
    from printhammer.chaos.continuation.events import BranchEvent
    from printhammer.results import Reopened
    from printhammer.run.regime import Regime

MOST: Final = 200
"""Number of steps of a curve in either direction unless told otherwise."""


def bifurcation_curve(
    source: Branch | Reopened | str | Path,
    second: str,
    bounds: tuple[float | str, float | str],
    *,
    event: BranchEvent | int | str | None = None,
    regime: Regime | None = None,
    first: tuple[float | str, float | str] | None = None,
    grid: tuple[int, int] = (0, 0),
    most: SupportsIndex = MOST,
    threads: int | None = None,
) -> BifurcationCurve:
    """Follow a fold, a period doubling, a Neimark-Sacker point or a grazing through a second constant.

    Parameters
    ----------
    source : Branch, Reopened or path
        A branch from `printhammer.continuation`; or a file with one, with several, of which the first counts,
        or with a curve, which is then followed anew from one of its points. Its constant is the first one.
    second : str
        The second constant, such as "backstop.damping" or "waveform.amplitude".
    bounds : tuple
        Its least and largest value, SI or text with a unit.
    event : BranchEvent, int or str, optional
        Where the curve begins: an event of the branch, or its number, from 0 on; a kind, of which the first
        event counts; or "first" or "last", where the branch ends in a grazing. By default the first event
        that can be followed. Of a curve in a file the number of a point, "first" or "last".
    regime : Regime, optional
        Of a file: the hammer and how it is fired.
    first : tuple, optional
        Least and largest value of the first constant, by default those of the branch.
    grid : tuple of int, optional
        Numbers of values of the two constants at which trains from rest are judged; by default none.
    most : int, optional
        Number of steps in either direction.
    threads : int, optional
        By default as many as there are cores; the curve does not depend on it.

    Returns
    -------
    BifurcationCurve
        Every point is met by Newton's method to a correction of 1e-12 of the scales, or to the noise of the
        map where that is larger.

    Raises
    ------
    InputError
        An argument is not what is described above; the branch has no such event; both constants are the same;
        a range does not hold the start.
    """
    start = start_of(source, event, regime)
    unit = start.regime.quantity(start.first).si
    check_two(start.first, second)
    own = start.bounds if first is None else read_bounds(start.regime, start.first, first)
    ends = read_bounds(start.regime, second, bounds)
    value = start.regime.value(second) if start.other is None else start.other
    for name, (low, high), at in ((start.first, own, start.value), (second, ends, value)):
        if not low <= at <= high:
            raise InputError(
                f"{name} = {at:.9g} {start.regime.quantity(name).si} at the start, expected one within the"
                f" bounds {low:.9g} to {high:.9g}"
            )
    plane = Plane(start.regime, (start.first, second), (own, ends), start.firings, start.tolerance)
    steps = Steps(most=read_count(most, "most"), precision=PRECISION)
    traced = CurveTracer(plane, start.kind, steps).trace(start, value, threads)
    away = abs(traced.places[_nearest(traced, value)].first - start.value)
    if not away < 0.1 * (own[1] - own[0]):
        raise InputError(
            f"{start.kind} at {start.first} = {start.value:.9g} {unit}: Newton's method leads away from it"
        )
    return curve_of(plane, traced, grid, threads)


def _nearest(traced: Traced, value: float) -> int:
    return int(np.argmin([abs(place.second - value) for place in traced.places]))


def curve_of(plane: Plane, traced: Traced, grid: tuple[int, int], threads: int | None) -> BifurcationCurve:
    """Return a curve that was followed as a result."""
    places = traced.places
    coefficients, sides = traced.coefficients, np.zeros((len(places), MOST_PERIODS + 1), np.int64)
    if traced.kind == GRAZING and traced.surface == "backstop":
        coefficients = np.array([root_coefficient(plane, place) for place in places])
        sides = np.array([grazing_sides(plane, place) for place in places])
    axes, settled = settled_plane(plane.regime, plane.names, plane.bounds, grid, threads)
    names = plane.names
    return BifurcationCurve(
        regime=plane.regime,
        kind=traced.kind,
        surface=traced.surface,
        names=names,
        units=(plane.regime.quantity(names[0]).si, plane.regime.quantity(names[1]).si),
        bounds=plane.bounds,
        firings=plane.firings,
        tolerance=plane.tolerance,
        first=np.array([place.first for place in places]),
        second=np.array([place.second for place in places]),
        state=np.array([place.state for place in places]),
        phase=np.array([place.phase for place in places]),
        multipliers=np.array([node.multipliers for node in traced.nodes]),
        coefficient=coefficients,
        sides=sides,
        contacts=tuple(place.contacts for place in places),
        points=tuple(traced.points),
        stops=traced.stops,
        crossings=traced.crossings,
        grid=axes,
        settled=settled,
    )
