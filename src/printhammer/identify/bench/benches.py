"""Test benches of the synthetic laboratory: true values of each measurement, before sensor errors.

magnet
    Armature held on a grid of displacements and currents, pack absent: force of magnet and spring.
spring
    Armature held at several displacements, magnet removed: force of the spring.
pack
    Slow load cycles to several peak indentations: force on the loading and unloading branches.
backstop
    Armature alone, thrown at the backstop at several speeds: rebound speed.
motion
    One shot from rest: displacement and current, from shortly before the firing.
current
    Current of one shot of a voltage driver, with the armature free or locked.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

import numpy as np
import numpy.typing as npt

from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.static_force import StaticForce, law_of
from printhammer.identify.bench.sensor import Sensor
from printhammer.identify.current import check_driver, probe_current
from printhammer.identify.lowpass import lowpass_motion, lowpass_waveform, time_constant
from printhammer.parts.backstop._hertz import damping_from_restitution
from printhammer.parts.backstop.hertz import HertzBackstop
from printhammer.results import Declared, part
from printhammer.run.plain.posing import CYCLE
from printhammer.run.simulate import simulate
from printhammer.run.supply import typical_current
from printhammer.run.window import time_scale, wait_of
from printhammer.support.arrays import FloatArray

DISPLACEMENTS: Final = 31  # Arbitrary
"""Default number of displacements in a static force table, evenly spaced from backstop to platen."""

CURRENTS: Final = 6
"""Default number of coil currents in a static force table, evenly spaced from zero; arbitrary."""

HIGHEST_CURRENT: Final = 1.25
"""Default highest coil current, as a multiple of the waveform's peak; arbitrary."""

PEAKS: Final = (0.3, 0.45, 0.6)
"""Default peak indentations of the load cycles, as fractions of the pack thickness.

If the pack has no thickness, the largest peak is the indentation that a single pulse causes. Arbitrary.
"""

BRANCH_POINTS: Final = 30
"""Default number of readings per branch of a load cycle; arbitrary."""

SPEEDS: Final = (0.1, 2.0, 40)
"""Default lowest and highest impact speed on the backstop, m/s, and number of impacts; arbitrary."""

BEFORE: Final = 100e-6
"""Default time between the start of the record and the firing, s; arbitrary."""

_FINEST: Final = 0.5e-6  # Arbitrary
"""Largest time step of the displacement before low-pass filtering, s: about 1/100 of a contact's duration."""

_MOST: Final = 2_000_000
"""Largest number of time steps in a record, to limit the memory use; arbitrary."""

_RUN_UP: Final = 10e-6
"""Initial distance of the armature from the backstop, m; arbitrary, as no force acts before the impact."""

_LONGEST: Final = 30
"""Maximum number of doublings of the simulation time for a rebound; arbitrary."""

_LEAST: Final = 1e-6
"""Lower bound of the coefficient of restitution in the search for the rebound speed; arbitrary."""


class Bench(Declared, eq=False):
    """True values of one measurement, before sensor errors."""

    what: str = part("description of the measurement in one line")
    true: dict[str, FloatArray] = part("columns by name, SI, before noise and resolution, shape (rows,)")
    suspect: str = part("column in which gross errors occur")
    words: dict[str, tuple[str, ...]] = part("text columns", default_factory=dict)
    exact: tuple[str, ...] = part("columns without errors, such as the time", default=())
    notes: dict[str, str] = part("comments that a fit reads from the table", default_factory=dict)


def magnet(
    hammer: Hammer,
    sensor: Sensor,  # noqa: ARG001
    *,
    displacements: npt.ArrayLike | None = None,
    currents: npt.ArrayLike | None = None,
) -> Bench:
    """Compute the static force on the armature at given displacements [m] and coil currents [A]."""
    if hammer.magnet is None:
        raise InputError(
            f"{hammer.path}: the hammer has no [magnet]",
            file=hammer.path,
            key="magnet",
            expected="a hammer with this part, whose force is measured",
        )
    places = _places(hammer, displacements)
    levels = _currents(hammer) if currents is None else _array(currents, "currents")
    force = StaticForce(hammer)
    x = np.tile(places, len(levels))
    current = np.repeat(levels, len(places))
    total = np.array([force.free(*row) for row in zip(x.tolist(), current.tolist(), strict=True)])
    if not np.isfinite(total).all():
        bad = float(x[~np.isfinite(total)][0])
        raise InputError(
            f"{hammer.path}: the magnet has no force at {bad:.6g} m",
            file=hammer.path,
            key="magnet",
            expected="displacements and currents within the range of the magnet's law",
        )
    return Bench(
        "static force of magnet and spring, armature held, pack absent; positive toward the pack",
        {"displacement": x, "current": current, "force": total},
        "force",
    )


def spring(
    hammer: Hammer,
    sensor: Sensor,  # noqa: ARG001
    *,
    displacements: npt.ArrayLike | None = None,
) -> Bench:
    """Compute the static spring force at given displacements [m], with the magnet removed."""
    if hammer.spring is None:
        raise InputError(
            f"{hammer.path}: the hammer has no [spring]",
            file=hammer.path,
            key="spring",
            expected="a hammer with this part, whose force is measured",
        )
    x = _places(hammer, displacements)
    force = StaticForce(hammer)
    return Bench(
        "static force of the spring alone, magnet removed; positive toward the pack",
        {"displacement": x, "force": np.array([force.spring(place) for place in x.tolist()])},
        "force",
    )


def pack(
    hammer: Hammer,
    sensor: Sensor,  # noqa: ARG001
    *,
    peaks: npt.ArrayLike | None = None,
    points: int = BRANCH_POINTS,
) -> Bench:
    """Compute load cycles of the pack up to given peak indentations, m, each cycle on fresh paper.

    The loading branch of a cycle has `points` readings, the unloading branch one reading fewer.
    """
    if hammer.pack is None:
        raise InputError(
            f"{hammer.path}: the hammer has no [pack]",
            file=hammer.path,
            key="pack",
            expected="a hammer with a pack",
        )
    deepest = _peaks(hammer) if peaks is None else _array(peaks, "peaks")
    if points < 2 or not (deepest > 0.0).all():
        raise InputError(
            "peaks and points", expected="positive indentations and 2 points or more", key="peaks"
        )
    room = getattr(hammer.pack, "thickness", math.inf)
    if deepest.max() >= room:
        raise InputError(
            f"a peak of {deepest.max():.6g} m",
            expected=f"less than the thickness, {room:.6g} m",
            key="peaks",
        )
    (loading, c), (memory, _), (unloading, _) = (
        law_of(hammer, hammer.pack, f"pack_{name}") for name in ("loading", "memory", "unloading")
    )
    share = np.arange(1, points + 1) / points
    indentation, force = [], []
    branch: list[str] = []
    for peak in deepest.tolist():
        up, down = peak * share, peak * share[-2::-1]
        q = memory(c, hammer.pack.front + peak)
        indentation += [*up.tolist(), *down.tolist()]
        force += [-loading(c, hammer.pack.front + r, 0.0) for r in up.tolist()]
        force += [-unloading(c, hammer.pack.front + r, 0.0, q) for r in down.tolist()]
        branch += ["loading"] * len(up) + ["unloading"] * len(down)
    return Bench(
        "force of slow load cycles against the indentation from the front of the pack, each on a fresh pack",
        {"indentation": np.array(indentation), "force": np.array(force)},
        "force",
        {"branch": tuple(branch)},
    )


def backstop(hammer: Hammer, sensor: Sensor, *, speeds: npt.ArrayLike | None = None) -> Bench:  # noqa: ARG001
    """Compute rebound speeds of the armature alone, thrown at the backstop at `speeds` [m/s]."""
    if hammer.backstop is None:
        raise InputError(
            f"{hammer.path}: the hammer has no [backstop]",
            file=hammer.path,
            key="backstop",
            expected="a hammer with a backstop",
        )
    impacts = np.linspace(SPEEDS[0], SPEEDS[1], SPEEDS[2]) if speeds is None else _array(speeds, "speeds")
    if not (impacts > 0.0).all():
        raise InputError("speeds", expected="greater than 0 m/s", key="speeds")
    bare = hammer.replace({"magnet": None, "spring": None, "pack": None, "waveform": None})
    different, which = np.unique(impacts, return_inverse=True)
    rebound = np.array([_rebound(bare, speed) for speed in different.tolist()])[which]
    return Bench(
        "speeds of the armature alone just before and just after the backstop contact",
        {"impact speed": impacts, "rebound speed": rebound},
        "rebound speed",
    )


def motion(
    hammer: Hammer, sensor: Sensor, *, duration: float | str | None = None, before: float | str = BEFORE
) -> Bench:
    """Simulate the displacement and the current of one shot from rest.

    The record begins `before` [s] before the firing and ends `duration` [s] after the firing.
    """
    from printhammer.drive.trains import PulseTrain

    if hammer.waveform is None:
        raise InputError(
            f"{hammer.path}: the hammer has no [waveform] to fire",
            file=hammer.path,
            key="waveform",
            expected="one",
        )
    first, last, rate, length = _record(sensor, duration, before, wait_of(hammer))
    each = max(1, math.ceil(1.0 / (rate * _FINEST)))
    t = np.arange(first, last + 1) / rate
    fine = np.arange(last * each + 1) / (rate * each)
    shot = simulate(hammer, PulseTrain(hammer.waveform), duration=max(float(fine[-1]), length), times=fine)
    if not shot.ok:
        raise InputError(
            f"{hammer.path}: the simulation of the shot stopped early: {shot.message}",
            file=hammer.path,
            key="waveform",
        )
    tau = time_constant(sensor.bandwidth)
    shown = lowpass_motion(shot.t, shot.x[:, np.newaxis], shot.v[:, np.newaxis], tau)[::each, 0]
    after = t >= 0.0
    x = np.full(len(t), shown[0])
    x[after] = shown
    true = {"time": t, "displacement": x}
    if hammer.waveform.unit == "A":
        current = hammer.waveform.value(t)
        true["current"] = lowpass_waveform(hammer.waveform.segments(), t, tau) if tau else current
    what = "displacement of the armature in one shot from rest, fired at time 0"
    return Bench(what, true, "displacement", exact=("time",))


def current(
    hammer: Hammer,
    sensor: Sensor,
    *,
    duration: float | str | None = None,
    before: float | str = BEFORE,
    locked: float | str | None = None,
) -> Bench:
    """Simulate the coil current of one shot with a voltage driver, the armature free or locked.

    The record begins `before` [s] before the firing and ends `duration` [s] after the firing. `locked` [m] is
    the displacement at which the armature is locked; None for a free armature.
    """
    from printhammer.drive.input import read_number

    check_driver(hammer)
    waveform = hammer.waveform
    assert waveform is not None
    # Of a fast device, 4 ms show the whole pulse; the pulse of a slow device may last longer.
    least = CYCLE if duration is not None or time_scale(hammer) == 1.0 else wait_of(hammer)
    first, last, rate, _length = _record(sensor, duration, before, least)
    t = np.arange(first, last + 1) / rate
    place = None if locked is None else read_number(locked, "m", "locked")
    shown = probe_current(hammer, waveform, t, locked=place, tau=time_constant(sensor.bandwidth))
    held = "free" if place is None else "locked"
    what = f"current in the coil in one shot, switched on at time 0, armature {held}"
    notes = {} if place is None else {"locked": f"{place!r} m"}
    return Bench(what, {"time": t, "current": shown}, "current", exact=("time",), notes=notes)


BENCHES: Final[dict[str, Callable[..., Bench]]] = {
    "magnet": magnet,
    "spring": spring,
    "pack": pack,
    "backstop": backstop,
    "motion": motion,
    "current": current,
}


def _record(
    sensor: Sensor, duration: float | str | None, before: float | str, least: float = CYCLE
) -> tuple[int, int, float, float]:
    """Return the first and last sample index of a record, the sampling rate [Hz] and the duration [s].

    The firing has the sample index 0. `before` is the time from the start of the record to the firing, s, and
    `least` is the duration after the firing if `duration` is None, s.
    """
    from printhammer.drive.input import read_number, read_positive

    rate = sensor.sampling_rate
    if rate is None:
        raise InputError(
            "the sensor has no sampling rate", key="sensor", expected="a sampling rate, to make a record"
        )
    length = least if duration is None else read_positive(duration, "s", "duration")
    early = read_number(before, "s", "before")
    if early < 0.0:
        raise InputError.of("before", before, "0 s or more")
    first, last = -math.floor(early * rate + 1e-9), math.floor(length * rate + 1e-9)
    if last < 1:
        raise InputError(
            f"a record of {length:.6g} s at {rate:.6g} Hz has no sample after the firing", key="length"
        )
    each = max(1, math.ceil(1.0 / (rate * _FINEST)))
    if last * each - first > _MOST:
        raise InputError(
            f"a record of {length:.6g} s at {rate:.6g} Hz is too long",
            key="length",
            expected="a shorter record",
        )
    return first, last, rate, length


def _array(values: npt.ArrayLike, name: str) -> FloatArray:
    try:
        numbers = np.atleast_1d(np.asarray(values, dtype=np.float64))
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.ndim != 1 or not numbers.size or not np.isfinite(numbers).all():
        raise InputError(f"{name}", expected="a list of finite numbers in SI", key=name)
    return numbers


def _places(hammer: Hammer, displacements: npt.ArrayLike | None) -> FloatArray:
    if displacements is not None:
        return _array(displacements, "displacements")
    low, high = hammer.origin, StaticForce(hammer).end
    if not low < high or (hammer.platen is None and hammer.pack is None):
        raise InputError(
            f"{hammer.path}: the hammer has no platen or pack",
            file=hammer.path,
            key="platen",
            expected="explicit displacements",
        )
    return np.linspace(low, high, DISPLACEMENTS)


def _currents(hammer: Hammer) -> FloatArray:
    if hammer.waveform is not None and hammer.waveform.quantity == "voltage":
        from printhammer.drive.trains import PulseTrain

        return np.linspace(0.0, typical_current(hammer, PulseTrain(hammer.waveform)), CURRENTS)
    if hammer.waveform is None or hammer.waveform.unit != "A":
        raise InputError(
            f"{hammer.path}: the hammer has no current waveform",
            file=hammer.path,
            key="current",
            expected="explicit currents",
        )
    return np.linspace(0.0, HIGHEST_CURRENT * hammer.waveform.peak, CURRENTS)


def _peaks(hammer: Hammer) -> FloatArray:
    thickness = getattr(hammer.pack, "thickness", None)
    if thickness is None:
        from printhammer.drive.trains import PulseTrain

        dots = [] if hammer.waveform is None else simulate(hammer, PulseTrain(hammer.waveform), points=2).dots
        deepest = dots[0].indentation if dots else None
        if deepest is None:
            raise InputError(
                f"{hammer.path}: the pack has no thickness, and no pulse of the hammer presses it",
                file=hammer.path,
                key="pack",
                expected="explicit peak indentations (--peaks)",
            )
        return float(deepest) * np.array(PEAKS) / PEAKS[-1]
    return float(thickness) * np.array(PEAKS)


def _rebound(bare: Hammer, speed: float) -> float:
    """Compute the rebound speed [m/s] of an armature thrown at the backstop, without any other force."""
    part = bare.backstop
    if isinstance(part, HertzBackstop):
        from scipy.optimize import brentq

        k, damping, _pull = part.packed(bare.origin)
        if damping == 0.0:
            return speed

        # Closed form of a free rebound, equations (6) and (7): the damping falls with the restitution.
        def excess(e: float) -> float:
            return damping_from_restitution(k, e, speed) / damping - 1.0

        return speed * brentq(excess, _LEAST, 1.0, xtol=1e-15)
    from printhammer.drive.trains import PulseTrain
    from printhammer.drive.waveforms.shapes import Rectangle

    idle = PulseTrain(Rectangle(amplitude=0.0, width=1e-6, rise=0.0, decay=0.0, quantity="force"))
    duration = 4.0 * _RUN_UP / speed
    for _ in range(_LONGEST):
        run = simulate(bare, idle, duration=duration, state=(bare.origin + _RUN_UP, -speed), points=2)
        if not run.ok:
            raise InputError(
                f"{bare.path}: the rebound at {speed:.6g} m/s did not end: {run.message}",
                file=bare.path,
                key="speeds",
            )
        left = run.contacts[0].v_out if run.contacts else None
        if left is not None:
            return float(left)
        duration *= 2.0
    raise InputError(
        f"{bare.path}: the armature does not rebound from the backstop at {speed:.6g} m/s",
        file=bare.path,
        key="speeds",
    )
