"""Thermal duty: the largest dot rate within a coil's temperature limit, and bursts at higher rates.

The coil is modelled as one thermal mass, or as two: winding, temperature T, and surrounding body, temperature
B.

      C dT/dt  = f E(T) - (T - B) / R          winding, heat capacity C, thermal resistance R to the body
      C' dB/dt = (T - B) / R - (B - A) / R'    body, heat capacity C', R' to the ambient temperature A

f is the dot rate and E(T) the coil heat per dot (`dot_heat`, `heat_of`); with one mass, B = A. In the steady
state the winding is f E(T) (R + R') above ambient, so the largest rate at a limit L is (L - A) / (E(L) (R +
R')): for a given limit it decreases linearly with the ambient temperature, whatever the rail and the driver.

Source: the lumped thermal network of any text on heat transfer. Validity: pulses that are short compared with
the warming of the winding, so that their heat is averaged over time. Weakness: the winding has one
temperature, whereas a real winding is hotter inside. The heat of a dot is that of a dot fired from rest; dots
whose currents overlap heat the coil more, and the summary states the lowest rate at which currents overlap.

Coil heat per dot: the resistance of copper rises by 0.393 % per kelvin of its value at 20 degC. A rail
pulse that is long compared with L / R draws less current through a warm winding and heats it less; a driver
that regulates the current heats it more; a driver that regulates the energy of a dot heats a warm and a cold
winding alike.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from printhammer.drive.input import read_number, read_positive
from printhammer.drive.trains import PulseTrain
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.parts.coil import COPPER, REFERENCE
from printhammer.results import Result, column, coordinate, part, scalar
from printhammer.results.summary import (
    Cells,
    Facts,
    Grid,
    Summary,
)
from printhammer.support.arrays import FloatArray
from printhammer.support.roots import bisect

COLDEST: Final = REFERENCE - 1.0 / COPPER
"""Temperature at which the linear law of copper's resistance extrapolates to zero, degC."""

FEEDS: Final = ("voltage", "current", "energy")
"""Names of the quantities that a driver may keep constant as the coil warms."""


@dataclass(frozen=True)
class DotHeat:
    """Heat dissipated in the coil per dot, as a function of the winding temperature."""

    temperature: tuple[float, ...]
    """Winding temperatures, degC, ascending; at least one temperature."""
    heat: tuple[float, ...]
    """Coil heat per dot at each temperature, J."""
    feed: str
    """Quantity that the driver keeps constant, from `FEEDS`; selects how the heat is interpolated."""
    on_time: float = 0.0
    """On-time of the driver per dot, s; 0 if unknown."""
    strike: str = "dot"
    """Word for the result of a pulse, such as "dot" or "closing"; see `Hammer.strike`."""
    lasts: float = 0.0
    """Time from the firing until the current has decayed to 1 % of its largest value, s; 0 if unknown."""

    @property
    def apart(self) -> float:
        """Largest dot rate at which the coil current decays before the next firing, Hz."""
        return 1.0 / self.lasts if self.lasts > 0.0 else math.inf

    @property
    def most(self) -> float:
        """Largest dot rate at which the driver still switches off between dots, Hz."""
        return 1.0 / self.on_time if self.on_time > 0.0 else math.inf

    def at(self, temperature: float) -> float:
        """Return the coil heat [J] per dot at a winding temperature [degC]."""
        shares = [
            heat / _share(self.feed, place) for heat, place in zip(self.heat, self.temperature, strict=True)
        ]
        return float(np.interp(temperature, self.temperature, shares)) * _share(self.feed, temperature)


def dot_heat(heat: float | str, feed: str = "voltage") -> DotHeat:
    """Build a `DotHeat` from the coil heat per dot at 20 degC, J, and the quantity that the driver regulates.

    `feed` is "voltage", "current" or "energy".
    """
    if feed not in FEEDS:
        raise InputError.of("feed", feed, f"one of {', '.join(FEEDS)}")
    return DotHeat((REFERENCE,), (read_positive(heat, "J", "heat"),), feed)


def read_temperature(value: float | str, name: str) -> float:
    """Parse a temperature, a number in degC or text such as "60 degC", above `COLDEST`.

    Raises
    ------
    InputError
        The value is not a temperature, or is so low that the linear law gives copper no resistance.
    """
    temperature = read_number(value, "degC", name)
    if not temperature > COLDEST:
        raise InputError.of(name, value, f"more than {COLDEST:.4g} degC")
    return temperature


def _share(feed: str, temperature: float) -> float:
    """Return the coil heat per dot at a temperature [degC], divided by the heat per dot at 20 degC."""
    warm = 1.0 + COPPER * (temperature - REFERENCE)
    return {"voltage": 1.0 / warm, "current": warm, "energy": 1.0}[feed]


HOTTEST: Final = 1500.0
"""Upper bound of the search for a steady temperature, degC; above the melting point of copper. Arbitrary."""

_TOLERANCE: Final = 1e-9  # Relative and absolute tolerance of the temperatures; arbitrary


@dataclass(frozen=True)
class ThermalCoil:
    """Thermal model of a coil: one thermal mass (winding), or two (winding and body)."""

    resistance: float
    """Thermal resistance from the winding to the body, or to ambient without a body, K/W."""
    capacity: float | None = None
    """Heat capacity of the winding, J/K; None if unknown; burst times are then NaN."""
    body_resistance: float = 0.0
    """Thermal resistance from the body to ambient, K/W; 0 for one thermal mass."""
    body_capacity: float | None = None
    """Heat capacity of the body, J/K."""

    @property
    def whole(self) -> float:
        """Thermal resistance from the winding to ambient, K/W."""
        return self.resistance + self.body_resistance


class ThermalDuty(Result, rows="ambient burst"):
    """Largest continuous dot rates of a coil, and the allowed bursts at higher rates."""

    coil: ThermalCoil = part("thermal model")
    heat: DotHeat = part("coil heat per dot")
    limit: float = scalar("degC", "temperature limit of the winding")
    limit_heat: float = scalar("J", "coil heat per dot at the temperature limit")
    ambient: FloatArray = coordinate("degC", "ambient temperature", "ambient")
    rate: FloatArray = column(
        "Hz",
        "largest continuous dot rate",
        "ambient",
        more="0 if ambient exceeds the limit; at most the rate at which the driver switches off between dots",
    )
    burst: FloatArray = coordinate("Hz", "dot rate in a burst", "burst")
    temperature: FloatArray = column(
        "degC",
        "steady temperature of the winding at the dot rate of the burst",
        "ambient burst",
        more="infinite if the winding would melt",
    )
    time: FloatArray = column(
        "s",
        "time to heat the winding from ambient temperature to the limit at the dot rate of the burst",
        "ambient burst",
        more="infinite if the limit is never reached; NaN without a heat capacity",
    )
    share: FloatArray = column(
        "1",
        "largest duty cycle at the dot rate of the burst, for bursts short compared with the warming",
        "ambient burst",
    )

    @property
    def title(self) -> str:
        """One-line title with the temperature limit of the coil."""
        return f"thermal duty of a coil up to {self.limit:g} degC"

    @property
    def strike(self) -> str:
        """Word for the result of a pulse, such as "dot" or "closing"; see `Hammer.strike`."""
        return self.heat.strike

    def summary(self) -> Summary:
        """Tabulate the largest rates and the allowed bursts, one row per ambient temperature."""
        fast, ambient = np.meshgrid(self.burst, self.ambient, indexing="ij")
        temperature, time = (
            np.where(np.isfinite(each), each, np.nan).T.ravel() for each in (self.temperature, self.time)
        )
        rates = [
            Cells("ambient", self.ambient, "°C", "g"),
            Cells("largest\ncontinuous rate", self.rate, "Hz", ".4g"),
        ]
        bursts = [
            Cells("burst rate", fast.ravel(), "Hz", ".6g"),
            Cells("ambient", ambient.ravel(), "°C", "g"),
            Cells("steady temperature", temperature, "°C", ".1f"),
            Cells("time to limit", time, "s", ".3g"),
            Cells("duty cycle", 100.0 * self.share.T.ravel(), "%", ".1f"),
        ]
        facts = [
            ("limit of the winding", f"{self.limit:g} °C"),
            ("coil heat per dot at the limit", f"{1e3 * self.limit_heat:.4g} mJ"),
            (
                "driver on",
                f"{1e3 * self.heat.on_time:.4g} ms a dot, at most {self.heat.most:.4g} Hz"
                if self.heat.on_time
                else None,
            ),
            (
                "current of a dot",
                f"lasts {1e3 * self.heat.lasts:.4g} ms: above {self.heat.apart:.4g} Hz dots overlap, and heat"
                " the coil more than computed"
                if max(self.rate.max(), self.burst.max(initial=0.0)) > self.heat.apart
                else None,
            ),
            ("held constant", f"the {self.heat.feed} of the driver"),
        ]
        return Summary([Facts(facts), "", Grid(rates), "", Grid(bursts)])


def thermal_duty(
    heat: float | str | DotHeat,
    thermal_resistance: float | str,
    limit: float | str,
    *,
    ambient: Sequence[float | str] = (25.0,),
    burst: Sequence[float | str] = (),
    feed: str = "voltage",
    thermal_capacity: float | str | None = None,
    body_resistance: float | str | None = None,
    body_capacity: float | str | None = None,
) -> ThermalDuty:
    """Compute the largest dot rates at which a coil stays below a temperature limit.

    Parameters
    ----------
    heat : float, str or DotHeat
        Coil heat per dot with the winding at 20 degC, J or text with a unit; or a function of the winding
        temperature; see `printhammer.control.duty.heat_of`.
    thermal_resistance : float or str
        Thermal resistance from the winding to ambient or, if the coil has a body, to the body, K/W.
    limit : float or str
        Temperature limit of the winding, degC.
    ambient : sequence of float or str, optional
        Ambient temperatures, degC.
    burst : sequence of float or str, optional
        Dot rates in a burst [Hz] for which to compute steady temperature, time to the temperature limit and
        largest duty cycle; by default the largest continuous rate at the lowest ambient temperature.
    feed : str, optional
        Quantity that the driver keeps constant as the coil warms: "voltage", "current" or "energy".
    thermal_capacity : float or str, optional
        Heat capacity of the winding, J/K; without a capacity, no time is computed.
    body_resistance, body_capacity : float or str, optional
        Thermal resistance from the body around the winding to ambient, K/W, and heat capacity of the body,
        J/K; both or neither.
    """
    one_dot = heat if isinstance(heat, DotHeat) else dot_heat(heat, feed)
    if (body_resistance is None) != (body_capacity is None):
        missing = "body_capacity" if body_capacity is None else "body_resistance"
        raise InputError(
            f"{missing} is missing", key=missing, expected="body_resistance and body_capacity, or neither"
        )
    if body_capacity is not None and thermal_capacity is None:
        raise InputError(
            "thermal_capacity is missing",
            key="thermal_capacity",
            expected="the heat capacity of the winding in addition to body_capacity",
        )
    coil = ThermalCoil(
        read_positive(thermal_resistance, "K/W", "thermal_resistance"),
        None if thermal_capacity is None else read_positive(thermal_capacity, "J/K", "thermal_capacity"),
        0.0 if body_resistance is None else read_positive(body_resistance, "K/W", "body_resistance"),
        None if body_capacity is None else read_positive(body_capacity, "J/K", "body_capacity"),
    )
    largest = read_temperature(limit, "limit")
    ambients = np.array([read_temperature(each, "ambient") for each in ambient])
    if not ambients.size:
        raise InputError("ambient is empty", key="ambient", expected="one temperature or more")
    at_limit = one_dot.at(largest)
    rate = np.minimum(np.maximum(largest - ambients, 0.0) / (at_limit * coil.whole), one_dot.most)
    bursts = np.array([_rate(each, one_dot) for each in burst or [rate.max()] if each != 0.0])
    pairs = [[(float(cold), float(fast)) for fast in bursts] for cold in ambients]
    shape = ambients.size, bursts.size

    def table(values: list[list[float]]) -> FloatArray:
        return np.array(values, dtype=np.float64).reshape(shape)

    return ThermalDuty(
        coil=coil,
        heat=one_dot,
        limit=largest,
        limit_heat=at_limit,
        ambient=ambients,
        rate=rate,
        burst=bursts,
        temperature=table([[steady(coil, one_dot, *pair) for pair in row] for row in pairs]),
        time=table([[time_to(coil, one_dot, largest, *pair) for pair in row] for row in pairs]),
        share=np.minimum(rate[:, None] / bursts, 1.0),
    )


def steady(coil: ThermalCoil, heat: DotHeat, ambient: float, rate: float) -> float:
    """Solve for the steady winding temperature [degC] at a dot rate [Hz]; inf above `HOTTEST`."""

    def excess(temperature: float) -> float:
        return rate * heat.at(temperature) * coil.whole - (temperature - ambient)

    return bisect(excess, ambient, HOTTEST) if excess(HOTTEST) < 0.0 else math.inf


def time_to(coil: ThermalCoil, heat: DotHeat, limit: float, ambient: float, rate: float) -> float:
    """Integrate the warming of the winding from ambient at a dot rate [Hz]; return the time to the limit, s.

    The time is 0 if the ambient temperature exceeds the limit, infinite if the winding never reaches the
    limit, and NaN if the heat capacity is unknown.
    """
    if limit <= ambient:
        return 0.0
    # At or below the largest continuous rate the limit is never exceeded.
    if rate * heat.at(limit) * coil.whole <= limit - ambient:
        return math.inf
    if coil.capacity is None:
        return math.nan
    from scipy.integrate import solve_ivp

    winding, around = coil.capacity, coil.body_capacity
    slowest = (winding + (around or 0.0)) * coil.whole

    def slopes(_t: float, state: Any) -> list[float]:
        body = ambient if around is None else state[1]
        flow = (state[0] - body) / coil.resistance
        warming = (rate * heat.at(state[0]) - flow) / winding
        if around is None:
            return [warming]
        return [warming, (flow - (body - ambient) / coil.body_resistance) / around]

    def reached(_t: float, state: Any) -> float:
        return float(state[0] - limit)

    reached.terminal = True  # type: ignore[attr-defined]
    start, span = [ambient] * (1 if around is None else 2), slowest
    while True:
        run = solve_ivp(slopes, (0.0, span), start, "LSODA", events=reached, rtol=_TOLERANCE, atol=_TOLERANCE)
        times = run.t_events or [np.zeros(0)]
        if times[0].size:
            return float(times[0][0])
        # Just above the continuous rate the time to the limit is arbitrarily long.
        if span > 64.0 * slowest:
            return math.inf
        span *= 4.0


def _rate(value: float | str, heat: DotHeat) -> float:
    rate = read_number(value, "Hz", "burst")
    if rate <= 0.0:
        raise InputError.of("burst", value, "greater than 0 Hz")
    if rate > heat.most:
        expected = f"at most {heat.most:.6g} Hz, since the driver is on for {1e3 * heat.on_time:.4g} ms a dot"
        raise InputError.of("burst", value, expected)
    return rate


TEMPERATURES: Final = (20.0, 40.0, 60.0, 80.0, 100.0, 120.0, 140.0)
"""Winding temperatures at which a hammer with a driver is simulated, degC; arbitrary."""

_LEFT: Final = 1e-3  # Residual current at which a pulse counts as ended, as a fraction of its peak; arbitrary
_DECAYED: Final = 0.01
"""Fraction of its peak below which the current of a dot counts as decayed; arbitrary.

The smaller current changes the heat of the next dot by at most 2 %."""

_DOUBLINGS: Final = 8  # Iteration limit of the doublings of the simulated time; arbitrary


def heat_of(hammer: Hammer) -> DotHeat:
    """Compute the coil heat per dot of a hammer as a function of the winding temperature.

    A driver is simulated from rest at the coil temperatures `TEMPERATURES`; a waveform that is a current is
    assumed to be regulated, whatever the resistance.

    Raises
    ------
    InputError
        The hammer has no coil resistance, its waveform is a force, or its current does not decay.
    """
    from printhammer.drive.trains import PulseTrain
    from printhammer.run.energy import squared_current

    waveform: Any = hammer.waveform
    if hammer.coil_resistance is None:
        raise InputError(
            f"{hammer.path}: coil.resistance is missing",
            file=hammer.path,
            key="coil.resistance",
            expected="it for the heat of a dot",
        )
    if waveform is None or waveform.quantity == "force":
        raise InputError(
            f"{hammer.path}: expected a [waveform] of a voltage or a current for the heat of a dot",
            file=hammer.path,
            key="waveform",
        )
    drive = PulseTrain(waveform, at=[0.0])
    if waveform.quantity == "current":
        heat = hammer.coil_resistance * squared_current(drive, 0.0, waveform.support)
        return DotHeat((REFERENCE,), (heat,), "current", strike=hammer.strike, lasts=waveform.support)
    losses = [_copper_loss(hammer.replace("coil.temperature", warm), drive) for warm in TEMPERATURES]
    heats, ends = zip(*losses, strict=True)
    return DotHeat(TEMPERATURES, heats, "voltage", waveform.support, hammer.strike, max(ends))


def _copper_loss(hammer: Hammer, drive: PulseTrain) -> tuple[float, float]:
    """Simulate one firing until the current has decayed; return the coil heat, J, and the time needed, s.

    The time is measured from the firing until the current has decayed to `_DECAYED` times its peak.
    """
    from printhammer.run.simulate import simulate

    span = 4.0 * drive.waveform.support
    for _ in range(_DOUBLINGS):
        motion = simulate(hammer, drive, duration=span, ledger=True)
        size = abs(motion.current)
        if size[-1] <= _LEFT * size.max():
            flowing = np.flatnonzero(size > _DECAYED * size.max())
            return motion.energy.copper_loss, float(motion.t[flowing[-1]]) if flowing.size else 0.0
        span *= 2.0
    raise InputError(
        f"{hammer.path}: the current does not decay",
        file=hammer.path,
        key="waveform",
        expected="a current that decays, so that a dot has a finite heat",
    )
