"""Coil circuit with the flux linkage as a state variable, fed by a voltage source or a driver.

With the flux linkage lambda_m(x, i) of the magnet and the constant inductance L of the coil, the circuit
obeys

    d lambda / dt = u - R i,    lambda = lambda_m(x, i) + L i,

and force and flux linkage derive from one coenergy W'(x, i): F = dW'/dx, lambda_m = dW'/di. A shorted turn of
resistance Re (referred to the coil) and leakage inductance Ls carries the current ie:

    lambda = lambda_1 + Ls i,    d lambda_1 / dt = -Re ie,    lambda_1 = lambda_m(x, i + ie) + L (i + ie).

H. H. Woodson and J. R. Melcher, *Electromechanical Dynamics* (1968), ch. 3. A reservoir of capacitance C,
charged from V through Rc and shared by n coils, has the voltage q: dq/dt = (V - q) / (Rc C) - n i / C.

The electric state is the tuple ``(lambda, lambda_1, q)``; it is empty in a kernel without a circuit. The
drive argument of the force functions is ``live`` without a circuit, and ``(live, electric)`` with one. The
last two elements of ``live`` hold the state of the driver: the end of the off-time [s] of a fixed off-time
chopper, and the conduction path of the coil current.

At most one piece of a driver is active at a time. Its pieces are ``[start, SWITCHED_PIECE, voltage, series
resistance, upper, lower]`` with the current thresholds of the chopper [A], where `upper` is infinite without
a chopper, and `lower` is minus the off-time [s] of a fixed off-time chopper; ``[start, DECAY_PIECE, voltage
that opposes the decaying current, series resistance, fraction of the energy returned to the supply, 0]``; and
``[start, RESERVOIR_PIECE, 0, series resistance, 0, 0]``. All other pieces are the voltage of an ideal source,
which conducts in both directions.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import compiled, inlined
from printhammer.kernel.model.layout import (
    CAPACITANCE,
    CHARGED,
    CHARGING,
    COILS,
    COUPLED,
    CURRENT_SCALE,
    DECAY_PIECE,
    DIODE,
    INDUCTANCE,
    LEAKAGE,
    LINKAGE_SCALE,
    MAGNET,
    RESERVOIR_PIECE,
    RESISTANCE,
    SERIES,
    SWITCHED_PIECE,
    TURN_RESISTANCE,
)

if TYPE_CHECKING:
    from printhammer.kernel.model.laws import (
        HAS_CIRCUIT,
        magnet_current,
        magnet_emf,
        magnet_inductance,
        magnet_linkage,
    )
    from printhammer.kernel.model.pulses import Drive, drive_value

Hammer = Any

Electric = Any
"""Electric state: flux linkages of coil and shorted turn [Wb], reservoir voltage [V]; empty without a
circuit."""

SOURCE, CHOPPED, BLOCKED, BACKWARD = 0.0, 1.0, 2.0, 3.0
"""Conduction paths of the coil current: through the source, through the freewheeling diode of a chopper,
blocked (no current), and decay of a negative current."""

PATH = 1
"""Index in `live`, counted from its end, of the conduction path of the coil current."""
UNTIL = 2
"""Index in `live`, counted from its end, of the end of the chopper's off-time."""

STILL_SHARE = 1e-12
"""Largest change of the electric state in one characteristic time that is treated as zero, relative to the
scales."""


@inlined
def driven(live: Any, electric: Electric) -> Drive:
    """Return the drive argument of the force functions: `live`, or `live` and the electric state."""
    if HAS_CIRCUIT:
        return live, electric
    return live


@inlined
def electric_in(drive: Drive) -> Electric:
    """Return the electric state in the drive argument of the force functions; `()` without a circuit."""
    if HAS_CIRCUIT:
        return drive[1]
    return ()


@inlined
def path_of(live: Any) -> float:
    """Return the present conduction path of the coil current, stored in `live`."""
    return float(live[live.size - PATH])


@inlined
def take_path(live: Any, path: float, until: float) -> None:
    """Store the conduction path of the coil current in `live`, with the end `until` [s] of an off-time."""
    live[live.size - PATH] = path
    live[live.size - UNTIL] = until


@inlined
def kind_of(live: Any) -> float:
    """Return the kind of the first active waveform piece; -1 if no piece is active."""
    return float(live[3]) if live[0] > 0.0 else -1.0


@inlined
def current_at(x: float, linkage: float, hammer: Hammer) -> float:
    """Return the magnetising current [A] at displacement `x` [m] and flux linkage `linkage` [Wb]."""
    if hammer[COUPLED] != 0.0:
        return float(magnet_current(hammer[MAGNET:], x, linkage, hammer[INDUCTANCE]))
    return float(linkage / hammer[INDUCTANCE])


@inlined
def linkage_at(x: float, current: float, hammer: Hammer) -> float:
    """Return the main flux linkage [Wb], without leakage, at displacement `x` [m].

    `current` is the magnetising current [A].
    """
    own = hammer[INDUCTANCE] * current
    if hammer[COUPLED] != 0.0:
        return float(magnet_linkage(hammer[MAGNET:], x, current) + own)
    return float(own)


@inlined
def coil_current(x: float, electric: Electric, hammer: Hammer, live: Any) -> float:
    """Return the coil current [A]; zero while its conduction path is blocked."""
    if path_of(live) == BLOCKED:
        return 0.0
    if hammer[TURN_RESISTANCE] > 0.0:
        return float((electric[0] - electric[1]) / hammer[LEAKAGE])
    return current_at(x, electric[0], hammer)


@inlined
def magnetising_current(x: float, electric: Electric, hammer: Hammer, live: Any) -> float:
    """Return the magnetising current [A]: coil current plus the current of the shorted turn, if any."""
    if hammer[TURN_RESISTANCE] > 0.0:
        return current_at(x, electric[1], hammer)
    return coil_current(x, electric, hammer, live)


@inlined
def source_of(t: float, electric: Electric, hammer: Hammer, live: Any) -> tuple[float, float]:
    """Return the source voltage [V] and the resistance in series with the coil [ohm].

    Both belong to the present conduction path of the coil current.
    """
    kind = kind_of(live)
    if kind == SWITCHED_PIECE:
        if path_of(live) == CHOPPED:
            return -hammer[DIODE], 0.0
        return live[4], live[5]
    if kind == DECAY_PIECE:
        return (live[4] if path_of(live) == BACKWARD else -live[4]), live[5]
    if kind == RESERVOIR_PIECE:
        return electric[2], live[5]
    return drive_value(t, live), hammer[SERIES]


@inlined
def open_rate(x: float, v: float, electric: Electric, hammer: Hammer) -> float:
    """Return the time derivative of the flux linkage [V] for zero coil current."""
    if hammer[TURN_RESISTANCE] > 0.0:
        return float(-hammer[TURN_RESISTANCE] * current_at(x, electric[1], hammer))
    if hammer[COUPLED] != 0.0:
        return magnet_emf(hammer[MAGNET:], x, 0.0) * v
    return 0.0


@inlined
def reservoir_rate(current: float, electric: Electric, hammer: Hammer, live: Any) -> float:
    """Return the time derivative of the reservoir voltage [V/s] for a coil current [A]."""
    if hammer[CAPACITANCE] == 0.0:
        return 0.0
    rate = (hammer[CHARGED] - electric[2]) / hammer[CHARGING]
    if kind_of(live) == RESERVOIR_PIECE:
        rate -= hammer[COILS] * current
    return float(rate / hammer[CAPACITANCE])


@inlined
def electric_rates(
    t: float, x: float, v: float, electric: Electric, hammer: Hammer, live: Any
) -> tuple[float, float, float]:
    """Return the time derivatives of the electric state: flux linkages [V], reservoir voltage [V/s]."""
    if path_of(live) == BLOCKED:
        rate = open_rate(x, v, electric, hammer)
        return (
            rate,
            (rate if hammer[TURN_RESISTANCE] > 0.0 else 0.0),
            reservoir_rate(0.0, electric, hammer, live),
        )
    voltage, series = source_of(t, electric, hammer, live)
    current = coil_current(x, electric, hammer, live)
    turn = 0.0
    if hammer[TURN_RESISTANCE] > 0.0:
        turn = -hammer[TURN_RESISTANCE] * (current_at(x, electric[1], hammer) - current)
    rate = voltage - (hammer[RESISTANCE] + series) * current
    return rate, turn, reservoir_rate(current, electric, hammer, live)


@inlined
def moved(electric: Electric, pause: float, rates: Electric) -> Electric:
    """Extrapolate the electric state linearly by a time interval `pause` [s], with the given rates."""
    return (
        electric[0] + pause * rates[0],
        electric[1] + pause * rates[1],
        electric[2] + pause * rates[2],
    )


@compiled
def electric_at_rest(x: float, hammer: Hammer) -> tuple[float, float, float]:
    """Return the electric state at displacement `x` [m] with zero currents and a full reservoir."""
    linkage = linkage_at(x, 0.0, hammer)
    return linkage, linkage, hammer[CHARGED]


@compiled
def electric_with(
    x: float, current: float, turn: float, reservoir: float, hammer: Hammer
) -> tuple[float, float, float]:
    """Return the electric state for given currents in coil and shorted turn [A] and reservoir voltage [V].

    A reservoir voltage of NaN denotes a full reservoir.
    """
    charge = hammer[CHARGED] if math.isnan(reservoir) else reservoir
    if hammer[TURN_RESISTANCE] > 0.0:
        main = linkage_at(x, current + turn, hammer)
        return main + hammer[LEAKAGE] * current, main, charge
    linkage = linkage_at(x, current, hammer)
    return linkage, linkage, charge


@compiled
def turn_current(x: float, electric: Electric, hammer: Hammer, live: Any) -> float:
    """Return the current in the shorted turn [A]; 0 if the coil has no shorted turn."""
    if hammer[TURN_RESISTANCE] > 0.0:
        return current_at(x, electric[1], hammer) - coil_current(x, electric, hammer, live)
    return 0.0


@compiled
def without_current(x: float, electric: Electric, hammer: Hammer) -> tuple[float, float, float]:
    """Return a copy of the electric state with zero coil current; the other components are unchanged."""
    if hammer[TURN_RESISTANCE] > 0.0:
        return electric[1], electric[1], electric[2]
    return linkage_at(x, 0.0, hammer), electric[1], electric[2]


@inlined
def path_may_change(live: Any) -> bool:
    """Whether the conduction path of the coil current can change between two edges of the drive."""
    kind = kind_of(live)
    if kind == SWITCHED_PIECE:
        return path_of(live) != SOURCE or not math.isinf(live[6])
    return kind == DECAY_PIECE


@compiled
def path_gap(x: float, v: float, electric: Electric, hammer: Hammer, live: Any) -> float:
    """Return the event function for a change of conduction path: of order one, positive until the change."""
    kind, path = kind_of(live), path_of(live)
    scale = hammer[CURRENT_SCALE]
    if kind == SWITCHED_PIECE:
        if path == SOURCE:
            if math.isinf(live[6]):
                return 1.0
            return float((live[6] - coil_current(x, electric, hammer, live)) / scale)
        if path == CHOPPED:
            return float((coil_current(x, electric, hammer, live) - max(live[7], 0.0)) / scale)
        against = hammer[DIODE]
    elif kind == DECAY_PIECE:
        if path == SOURCE:
            return float(coil_current(x, electric, hammer, live) / scale)
        if path == BACKWARD:
            return float(-coil_current(x, electric, hammer, live) / scale)
        against = live[4]
    else:
        return 1.0
    return float((open_rate(x, v, electric, hammer) + against) / (scale * hammer[RESISTANCE]))


@compiled
def next_path(t: float, x: float, electric: Electric, hammer: Hammer, live: Any) -> Electric:
    """Select the next conduction path when `path_gap` reaches zero; return the electric state then."""
    path = path_of(live)
    if kind_of(live) == DECAY_PIECE:
        if path == BLOCKED:
            take_path(live, SOURCE, math.inf)
            return electric
        take_path(live, BLOCKED, math.inf)
        return without_current(x, electric, hammer)
    if path == SOURCE:
        take_path(live, CHOPPED, t - live[7] if live[7] < 0.0 else math.inf)
    elif path == BLOCKED:
        take_path(live, CHOPPED, live[live.size - UNTIL])
    elif live[7] >= 0.0:
        take_path(live, SOURCE, math.inf)
    else:
        take_path(live, BLOCKED, live[live.size - UNTIL])
        return without_current(x, electric, hammer)
    return electric


@compiled
def enter_piece(t: float, x: float, electric: Electric, hammer: Hammer, live: Any) -> Electric:
    """Select the conduction path when a waveform piece begins or an off-time ends.

    Returns the electric state, in which the coil current is zero if the path is blocked.
    """
    current = coil_current(x, electric, hammer, live)
    kind = kind_of(live)
    if kind == SWITCHED_PIECE and current >= live[6]:
        take_path(live, CHOPPED, t - live[7] if live[7] < 0.0 else math.inf)
    elif kind == DECAY_PIECE and abs(current) <= STILL_SHARE * hammer[CURRENT_SCALE]:
        take_path(live, BLOCKED, math.inf)
        return without_current(x, electric, hammer)
    elif kind == DECAY_PIECE and current < 0.0:
        take_path(live, BACKWARD, math.inf)
    elif kind != -1.0 or path_of(live) != BLOCKED:
        take_path(live, SOURCE, math.inf)
    return electric


@compiled
def is_quiet(t: float, x: float, time_scale: float, electric: Electric, hammer: Hammer, live: Any) -> bool:
    """Whether the electric state is constant until the next edge of the drive, with the armature at rest."""
    kind = kind_of(live)
    if kind != -1.0 and kind < SWITCHED_PIECE:
        return False
    rates = electric_rates(t, x, 0.0, electric, hammer, live)
    limit = STILL_SHARE * hammer[LINKAGE_SCALE] / time_scale
    voltage = STILL_SHARE * max(hammer[CHARGED], hammer[RESISTANCE] * hammer[CURRENT_SCALE]) / time_scale
    return bool(abs(rates[0]) <= limit and abs(rates[1]) <= limit and abs(rates[2]) <= voltage)


@compiled
def fastest_rate(x: float, electric: Electric, hammer: Hammer, live: Any) -> float:
    """Return the largest decay rate of the coil circuit [1/s], linearised about the present state."""
    if path_of(live) == BLOCKED and hammer[TURN_RESISTANCE] == 0.0:
        return 0.0
    current = magnetising_current(x, electric, hammer, live)
    inductance = hammer[INDUCTANCE]
    if hammer[COUPLED] != 0.0:
        inductance += magnet_inductance(hammer[MAGNET:], x, current)
    resistance = hammer[RESISTANCE] + source_of(0.0, electric, hammer, live)[1]
    if hammer[TURN_RESISTANCE] > 0.0:
        turn = hammer[TURN_RESISTANCE]
        return float(turn / inductance + (turn + resistance) / hammer[LEAKAGE])
    return float(resistance / inductance)
