"""Entry points for a web page that sets up a run: constants, rest position, supply, scales, window.

The entry points compute what `printhammer.run.problem` computes from a hammer and a drive. An outcome other
than 0 is a refusal; see `REFUSALS`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from printhammer.drive import tables
from printhammer.hammer.equilibrium import NO_REST
from printhammer.hammer.statics import EMPTY, Statics, Work, origin_of, rest_position, sorted_in_place
from printhammer.kernel.model.layout import (
    BACKSTOP_PART,
    COIL,
    COUPLED,
    CURRENT_SCALE,
    DAMPING,
    DIODE,
    FRONT,
    INDUCTANCE,
    INVERSE_MASS,
    LEAKAGE,
    LINKAGE_SCALE,
    MAGNET,
    PACK,
    POSITION,
    RESISTANCE,
    SPRING,
    SUPPLY,
)
from printhammer.kernel.model.modes import OK
from printhammer.parts.coil import coil_packed
from printhammer.run.plain.posing import (
    FAR,
    Coil,
    allowances,
    falling_place,
    flight_of,
    is_window,
    last_window,
    least_window,
    linkage_scale,
    sustained_current,
    typical_scales,
)

if TYPE_CHECKING:
    from printhammer.kernel.model.laws import (
        HAS_BACKSTOP,
        HAS_MAGNET,
        HAS_PACK,
        MEMORY,
        RIGID,
        RIGID_FRONT,
        backstop_elastic,
        magnet_force,
        magnet_inductance,
        magnet_linkage,
        pack_loading,
        spring_force,
        spring_level,
    )
    from printhammer.parts.absent import (
        backstop_packed,
        damping_packed,
        magnet_domain,
        magnet_packed,
        pack_packed,
        spring_domain,
        spring_packed,
    )

CURRENT, FORCE, VOLTAGE = 0.0, 1.0, 2.0
"""Codes of the driven quantity."""

FITS, WEAK_HOLD, FALLING_LINKAGE = range(3)
"""Outcomes of `supply`: valid; hold current out of reach; flux linkage does not increase with current."""


def fill_constants(
    body: Any,
    damping: Any,
    spring: Any,
    pack: Any,
    backstop: Any,
    coil: Any,
    magnet: Any,
    constants: Any,
    ends: Any,
) -> int:
    """Write the constants of a hammer in the order of `printhammer.kernel.model.layout`.

    Parameters
    ----------
    body : float64 array, shape (3,)
        Mass, kg; position of the backstop and front of the pack, m, NaN if missing.
    damping, spring, pack, backstop, coil, magnet : float64 arrays
        Values of the parts (`printhammer.parts.base.Part.numbers`), empty for an absent part.
    constants : float64 array
        Array of zeros, to which the constants are written.
    ends : float64 array, shape (2,)
        Output: smallest and largest displacement for which the laws of magnet and spring are valid, m.

    Returns
    -------
    int
        Number of constants.
    """
    constants[INVERSE_MASS] = 1.0 / body[0]
    origin = 0.0 if math.isnan(body[1]) else body[1]
    constants[POSITION] = origin
    constants[FRONT] = math.inf if math.isnan(body[2]) else body[2]
    damping_packed(damping, origin, constants[DAMPING:SPRING])
    spring_packed(spring, origin, constants[SPRING:PACK])
    pack_packed(pack, origin, constants[PACK:BACKSTOP_PART])
    backstop_packed(backstop, origin, constants[BACKSTOP_PART:COIL])
    if len(coil) > 0:
        coil_packed(coil, origin, constants[COIL:SUPPLY])
    magnet_domain(magnet, ends)
    spring_domain(spring, ends)
    return MAGNET + max(magnet_packed(magnet, origin, constants[MAGNET:]), 1)


def statics_at(constants: Any, limits: Any) -> Statics:
    """Build the functions and constants of the static force from the constants of a hammer.

    `limits` contains, in this order: the smallest and the largest displacement for which the laws of magnet
    and spring are valid [m]; the position of the platen [m], NaN without a platen; the thickness of the pack
    [m], NaN if not stated; and the mass [kg].
    """
    rigid, rigid_front, memory, has_magnet = False, False, False, False
    if RIGID:
        rigid = True
    if RIGID_FRONT:
        rigid_front = True
    if MEMORY:
        memory = True
    if HAS_MAGNET:
        has_magnet = True
    position, front = -math.inf, math.inf
    if HAS_BACKSTOP:
        position = constants[POSITION]
    if HAS_PACK:
        front = constants[FRONT]
    return Statics(
        magnet_force,
        spring_force,
        pack_loading,
        backstop_elastic,
        spring_level,
        constants[MAGNET:],
        constants[SPRING:PACK],
        constants[PACK:BACKSTOP_PART],
        constants[BACKSTOP_PART:COIL],
        position,
        front,
        rigid,
        rigid_front,
        memory,
        has_magnet,
        limits[0],
        limits[1],
        limits[2],
        limits[3],
    )


def find_rest(constants: Any, limits: Any, grid: Any, points: Any, found: Any, out: Any) -> int:
    """Find the rest position of the armature; see `printhammer.hammer.statics.rest_position`.

    Parameters
    ----------
    constants : float64 array
        Constants of the hammer.
    limits : float64 array, shape (5,)
        See `statics_at`.
    grid, points, found : float64 arrays, shapes (8192,), (2, 24576) and (24576, 3)
        Working space, whose contents are overwritten.
    out : float64 array, shape (2,)
        Rest position [m]; for a refusal, the numbers in its message.

    Returns
    -------
    int
        Outcome: 0 if found, else the code of a refusal; see `REFUSALS`.
    """
    work = Work(grid, points[0], points[1], found, sorted_in_place)
    return rest_position(statics_at(constants, limits), work, out)


def coil_at(constants: Any) -> Coil:
    """Build the functions and constants of the coil from the constants of a hammer."""
    coupled = False
    if HAS_MAGNET:
        coupled = constants[COUPLED] != 0.0
    return Coil(
        magnet_linkage,
        magnet_inductance,
        constants[MAGNET:],
        coupled,
        constants[INDUCTANCE],
        constants[LEAKAGE],
        constants[RESISTANCE],
    )


def fill_supply(constants: Any, limits: Any, about: Any, out: Any) -> int:
    """Write the supply of a voltage drive, and the scales of current and flux linkage, to the constants.

    Parameters
    ----------
    constants : float64 array
        Constants of the hammer.
    limits : float64 array, shape (5,)
        See `statics_at`.
    about : float64 array, shape (14,)
        Numbers about the pulse; see `printhammer.drive.tables.pulse`.
    out : float64 array, shape (4,)
        Numbers in the message of a refusal. `WEAK_HOLD`: hold current [A], largest current that the voltage
        sustains [A], voltage [V] and resistance [ohm]. `FALLING_LINKAGE`: inductance of the coil [H],
        inductance that it has to exceed [H], and displacement [m].

    Returns
    -------
    int
        Outcome, such as `FITS`.
    """
    coil = coil_at(constants)
    origin, series = constants[POSITION], about[tables.SERIES_OF_PULSE]
    voltage, upper = about[tables.LARGEST], about[tables.UPPER]
    limited, current = sustained_current(voltage, series, about[tables.SUPPORT], upper, origin, coil)
    hold = about[tables.HOLD_UPPER]
    if hold > current:
        out[0], out[1], out[2], out[3] = hold, current, voltage, coil.resistance + series
        return WEAK_HOLD
    current = limited if limited != 0.0 else 1.0
    high = origin
    if HAS_PACK:
        high = max(high, constants[FRONT])
    if not math.isnan(limits[2]):
        high = max(high, limits[2])
    place, slope = falling_place(origin, high, current, coil)
    if not math.isnan(place):
        out[0], out[1], out[2] = coil.inductance, coil.inductance - slope, place
        return FALLING_LINKAGE
    for k in range(tables.SHOWN - tables.SUPPLY_OF_PULSE):
        constants[DIODE + k] = about[tables.SUPPLY_OF_PULSE + k]
    constants[CURRENT_SCALE] = current
    constants[LINKAGE_SCALE] = linkage_scale(origin, current, coil)
    return FITS


def fill_scales(
    constants: Any,
    limits: Any,
    quantity: float,
    largest: float,
    period: float,
    start: Any,
    tolerance: float,
    out: Any,
) -> None:
    """Compute the step-size control of a run and the bounds of its displacement.

    Parameters
    ----------
    constants : float64 array
        Constants of the hammer, with the supply of a voltage drive.
    limits : float64 array, shape (5,)
        See `statics_at`.
    quantity, largest, period : float
        Code of the driven quantity (current 0, force 1, voltage 2), largest value of a pulse, and time
        between firings, s, NaN if the times between firings differ.
    start : float64 array, shape (2,)
        Displacement [m] and velocity [m/s] at the start.
    tolerance : float
        Tolerance of the run.
    out : float64 array, shape (8,)
        In this order: typical displacement [m] and speed [m/s]; tolerances of the two error estimates; lower
        and upper end of the displacement range of the laws [m]; origin [m]; and distance from the origin
        beyond which the motion is a runaway [m].
    """
    s = statics_at(constants, limits)
    current, push = largest, 0.0
    if quantity == FORCE:
        current, push = 0.0, largest
    elif quantity == VOLTAGE:
        current = constants[CURRENT_SCALE]
    out[0], out[1] = typical_scales(limits[4], current, push, period, (start[0], start[1]), s)
    out[2], out[3] = allowances(tolerance)
    out[4], out[5], out[6], out[7] = limits[0], limits[1], origin_of(s), FAR * out[0]


def begin_window(about: Any, rest: float, front: float, out: Any) -> int:
    """Write the smallest window [s], from the last firing to the end of a run, to the array `out`.

    Return whether a single pulse has to confirm that the window is long enough. `about` are the numbers about
    the pulse (`printhammer.drive.tables.pulse`), `rest` is the rest position [m], and `front` the front of
    the pack [m], NaN without a pack.
    """
    support = about[tables.SUPPORT]
    out[0] = least_window(support, about[tables.REPLACES] != 0.0)
    return 1 if math.isfinite(support) and rest < front else 0


def judge_window(status: int, contacts: Any, nodes: Any, places: Any, wait: float, out: Any) -> int:
    """Whether a window is long enough for a single pulse from rest; the caller doubles a shorter window.

    Parameters
    ----------
    status : int
        Status of the run.
    contacts, nodes : float64 arrays
        Record of the run; see `printhammer.kernel.single.record`.
    places : float64 array, shape (5,)
        In this order: rest position of the armature [m], front of the pack [m], typical displacement [m],
        typical speed [m/s], and smallest window [s].
    wait : float
        Window to check, which is the end time of the run, s.
    out : float64 array, shape (1,)
        Flight time of the single pulse, s; NaN without a dot.
    """
    flight = flight_of(contacts)
    out[0] = flight
    x, v = nodes[len(nodes) - 1, 1], nodes[len(nodes) - 1, 2]
    if is_window(status == OK, flight, x, v, places[0], places[1], wait):
        return 1
    return 1 if wait >= last_window(places[4], places[2], places[3]) else 0


REFUSALS: Final[dict[str, dict[int, tuple[str, str | None]]]] = {
    "rest": {**NO_REST, EMPTY: ("the range {0:g} to {1:g} m is empty", "the lower end first")},
    "supply": {
        WEAK_HOLD: (
            "hold_upper = {0:g} A",
            "less than {1:.4g} A, the most that {2:g} V drives through {3:.4g} ohm",
        ),
        FALLING_LINKAGE: (
            "coil.inductance = {0:g} H",
            "more than {1:.4g} H, so that the flux linkage rises with the current at x = {2:.4g} m",
        ),
    },
}
"""Messages for refused inputs: fault and expectation, by entry point and outcome, with numbers from `out`."""
