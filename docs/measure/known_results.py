"""Compare computed results for the oscillators of the literature with published or exact values.

Run ``.venv/bin/python docs/measure/known_results.py``, which takes a minute or two.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from measured import MOTION, Cell, Column, write

import printhammer as ph
from printhammer.chaos import orbit
from printhammer.chaos.continuation.branch import Branch
from printhammer.run.regime import Regime

ROOMS = (*MOTION, "chaos", "derivatives")
SHARP = 1e-9
"""Tolerance for results with a closed form."""
FRICTION = 0.3
"""Dry friction of the oscillator of Den Hartog, N."""


@dataclass(frozen=True)
class Known:
    """Known value of a shipped oscillator, with the function that computes it."""

    hammer: str
    what: str
    source: str
    expected: str
    """Known value, as printed; closed forms to twelve digits."""
    tolerance: float
    """Tolerance: half a unit of the last printed digit, or more for an average over a chaotic motion."""
    compute: Callable[[], float]


def resonant(omega: float, amplitude: float, phase: float, state: tuple[float, float], kind: str) -> float:
    """Return a bifurcation point of the orbits with one impact in two periods of the force."""
    (event,) = [
        event for event in resonant_branch(omega, amplitude, phase, state).events if event.kind == kind
    ]
    return float(event.value)


@cache
def resonant_branch(omega: float, amplitude: float, phase: float, state: tuple[float, float]) -> Branch:
    """Return the branch of orbits with one impact in two periods of the force, near an amplitude."""
    drive = ph.SineForce(amplitude, omega / (2.0 * math.pi), phase="90 deg")
    bounds = (amplitude * (1.0 - 2e-3), amplitude * (1.0 + 2e-3))
    hammer = ph.load("resonant-grazing")
    return ph.continuation(
        hammer, "drive.amplitude", bounds, drive=drive, state=state, firings=2, phase=phase
    )


FOLD = (0.799, 0.3628362, 0.0091, (1.91021, -0.06294))
DOUBLING = (0.81, 0.3475334, 0.0125, (1.95734, -0.03168))
FARTHER = (0.95001, 0.44844, 0.0059, (1.84241, -0.48668))


def product() -> float:
    """Return the product of the multipliers of orbits with one impact in two periods that deviates most."""
    branch = resonant_branch(*FARTHER)
    exact = 0.81 * math.exp(-4.0 * math.pi * 0.04 / FARTHER[0])
    products = branch.multipliers.prod(axis=1).real
    return float(products[np.abs(products - exact).argmax()])


def grazing(name: str, omega: float, start: float, bounds: tuple[float, float]) -> float:
    """Return the amplitude of the force at which the oscillation without impact touches the stop."""
    hammer = ph.load(name)
    spring = hammer.spring
    rest = hammer.position + spring.preload / spring.stiffness
    drive = ph.SineForce(start, omega / (2.0 * math.pi), phase="90 deg")
    branch = ph.continuation(hammer, "drive.amplitude", bounds, drive=drive, state=(rest, 0.0))
    (stop,) = [stop for stop in branch.stops if stop.reason == "grazing"]
    return float(stop.parameter)


def shaw_holmes(
    omega: float, amplitude: float, phase: float, state: tuple[float, float], firings: int, kind: str
) -> float:
    """Return a bifurcation point of the orbits with one impact in a number of periods of the force."""
    drive = ph.SineForce(amplitude, omega / (2.0 * math.pi), phase="90 deg")
    bounds = (0.99 * amplitude, 1.01 * amplitude)
    branch = ph.continuation(
        ph.load("shaw-holmes-1983"),
        "drive.amplitude",
        bounds,
        drive=drive,
        state=state,
        firings=firings,
        phase=phase,
    )
    (event,) = [event for event in branch.events if event.kind == kind]
    return float(event.value)


def shaken(amplitude: float, omega: float) -> ph.SineForce:
    """Return a force with the time course of a cosine."""
    return ph.SineForce(amplitude, omega / (2.0 * math.pi), phase="90 deg")


def two_stops(
    name: str, omega: float, amplitude: float, phase: float, state: tuple[float, float], kind: str
) -> float:
    """Return a bifurcation point of the orbits with one impact at each of two stops in a period."""
    bounds = (0.98 * amplitude, 1.015 * amplitude)
    drive = shaken(amplitude, omega)
    branch = ph.continuation(ph.load(name), "drive.amplitude", bounds, drive=drive, state=state, phase=phase)
    (event,) = [event for event in branch.events if event.kind == kind]
    return float(event.value)


def two_stops_product(
    name: str, omega: float, amplitude: float, phase: float, state: tuple[float, float]
) -> float:
    """Return the product of the multipliers of an orbit with one impact at each of two stops."""
    regime = Regime.of(ph.load(name), drive=shaken(amplitude, omega), phase=phase)
    return float(orbit(regime, state).multipliers.prod().real)


@cache
def doublings() -> list[float]:
    """Return the amplitudes of the table, cm, at successive period doublings of the ball."""
    ball, frequency = ph.load("tufillaro-1992"), 60.0
    weight, omega, e = -ball.spring.preload, 2.0 * math.pi * frequency, ball.backstop.restitution
    gravity, gamma = weight / ball.mass, 1.3
    # Phase of the table at an impact; half a period after phase 0 of the table, the ball is in flight.
    meets = math.acos(math.pi * (1.0 - e) / (1.0 + e) / gamma)
    height, leaves, later = gamma * gravity / omega**2, 0.5 * gravity / frequency, (math.pi - meets) / omega
    state = height * math.sin(meets) + leaves * later - 0.5 * gravity * later**2, leaves - gravity * later
    branch = ph.continuation(
        ball,
        "drive.amplitude",
        (weight, 1.75 * weight),
        drive=ph.SineForce(gamma * weight, frequency),
        state=(state[0], state[1] + height * omega),
        phase=0.5,
    )
    forces = []
    for _ in range(3):
        event = next(event for event in branch.events if event.kind == "period doubling")
        forces.append(event.value)
        branch = branch.doubled(event)
    return [100.0 * force / (ball.mass * omega**2) for force in forces]


@cache
def duffing() -> tuple[float, float, float]:
    """Return both exponents per unit of time, and their sum."""
    drive = ph.SineForce(0.3, 1.0 / (2.0 * math.pi), phase="90 deg")
    found = ph.lyapunov(
        ph.load("duffing-holmes"), drive=drive, state=(0.1, 0.1), firings=50_000, transient=500
    )
    assert found.growth == "chaotic"
    return float(found.per_second[0]), float(found.per_second[1]), found.total / (2.0 * math.pi)


@cache
def rocking() -> ph.Motion:
    """Simulate a block released at 0.6 of its tipping angle, in units of 1/p and of this angle."""
    return ph.simulate(ph.load("housner-1963"), ph.SineForce(0.0, 1.0), state=(0.6, 0.0), duration=12.0)


def rocking_angle(impacts: int) -> float:
    """Return the largest angle after a number of impacts."""
    return float(rocking().maxima[1][impacts - 1])


def dry(amplitude: float, omega: float, static: float, cycles: float) -> ph.Motion:
    """Simulate the oscillator with dry friction from the displacement 1 at rest."""
    hammer = ph.load("den-hartog-1931").replace("force.guide.static", static)
    return ph.simulate(
        hammer,
        shaken(amplitude, omega),
        duration=cycles * 2.0 * math.pi / omega,
        state=(1.0, 0.0),
        tolerance=1e-13,
    )


def dry_amplitude(amplitude: float, omega: float) -> float:
    """Return the largest displacement of the periodic motion under dry friction."""
    return float(dry(amplitude, omega, FRICTION, 30.0).maxima[1][-1])


def sticking(omega: float, static: float, low: float, high: float) -> float:
    """Return the amplitude of the force below which the periodic motion sticks, by bisection."""
    cycles = 30.0
    start = (cycles - 2.0) * 2.0 * math.pi / omega
    while high - low > 1e-11:
        middle = 0.5 * (low + high)
        sticks = dry(middle, omega, static, cycles).sticks
        if any(stick.t_in > start for stick in sticks):
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def dry_product() -> float:
    """Return the product of the multipliers of the periodic motion under dry friction."""
    regime = Regime.of(ph.load("den-hartog-1931"), drive=shaken(0.5, 0.7))
    return float(orbit(regime, (0.6, 0.2)).multipliers.prod().real)


def left_at_rest() -> float:
    """Return the displacement at which dry friction holds the mass after a release at 1."""
    (stick,) = ph.simulate(
        ph.load("den-hartog-1931"), ph.SineForce(0.0, 1.0), duration=10.0, state=(1.0, 0.0), tolerance=1e-13
    ).sticks
    return float(stick.x)


MODEL = "model of Simpson and Ghosh (2026), closed form"
SHAW = "model of Shaw and Holmes (1983), closed form"
BOOK = "Tufillaro, Abbott and Reilly (1992)"
HOUSNER = "Housner (1963), formula"
RECIPES = "Dankowicz and Schilder (2013), closed form"
DEN_HARTOG = "Den Hartog (1931), closed form"
SHAW_FRICTION = "Den Hartog (1931) and Shaw (1986), closed form"
PAIR = "model of Heiman, Bajaj and Sherman (1988), closed form"
SHAW_STOPS = "model of Shaw (1985), closed form"
HOLMES = "equation of Holmes (1979), quoted to three digits"

CASES = (
    Known(
        "resonant-grazing",
        "w = 0.81, one impact in two periods: F of the doubling",
        MODEL,
        "0.347533397412",
        SHARP,
        lambda: resonant(*DOUBLING, "period doubling"),
    ),
    Known(
        "resonant-grazing",
        "w = 0.95001, one impact in two periods: F of the doubling",
        MODEL,
        "0.448439415498",
        SHARP,
        lambda: resonant(*FARTHER, "period doubling"),
    ),
    Known(
        "resonant-grazing",
        "w = 0.799, one impact in two periods: F of the fold",
        MODEL,
        "0.362836201981",
        SHARP,
        lambda: resonant(*FOLD, "fold"),
    ),
    Known(
        "resonant-grazing",
        "w = 0.95001, one impact in two periods: product of the multipliers",
        MODEL,
        "0.477197034359",
        1e-10,
        product,
    ),
    Known(
        "resonant-grazing",
        "w = 0.81, without impact: F of the grazing",
        MODEL,
        "0.345422885750",
        SHARP,
        lambda: grazing("resonant-grazing", 0.81, 0.3, (0.25, 0.4)),
    ),
    Known(
        "shaw-holmes-1983",
        "w = 2.2, one impact in a period: F of the doubling",
        SHAW,
        "0.426985572704",
        SHARP,
        lambda: shaw_holmes(2.2, 0.427, 0.4823, (0.18637, 0.01023), 1, "period doubling"),
    ),
    Known(
        "shaw-holmes-1983",
        "w = 2.6, one impact in two periods: F of the doubling",
        SHAW,
        "0.251827113670",
        SHARP,
        lambda: shaw_holmes(2.6, 0.252, 0.0732, (0.0573, 0.2256), 2, "period doubling"),
    ),
    Known(
        "shaw-holmes-1983",
        "w = 2.6, one impact in two periods: F of the fold",
        SHAW,
        "0.087142997638",
        SHARP,
        lambda: shaw_holmes(2.6, 0.08715, 0.2649, (0.06975, 0.1598), 2, "fold"),
    ),
    *(
        Known(
            "tufillaro-1992",
            f"60 Hz, restitution 0.5: amplitude of doubling {k + 1}, cm",
            BOOK,
            printed,
            5e-9,
            lambda k=k: doublings()[k],
        )
        for k, printed in enumerate(("0.01053531", "0.01150345", "0.01170804"))
    ),
    Known(
        "duffing-holmes",
        "F = 0.3: larger exponent per unit of time",
        HOLMES,
        "0.159",
        2e-3,
        lambda: duffing()[0],
    ),
    Known(
        "duffing-holmes",
        "F = 0.3: smaller exponent per unit of time",
        HOLMES,
        "-0.359",
        2e-3,
        lambda: duffing()[1],
    ),
    Known(
        "duffing-holmes",
        "F = 0.3: sum of the exponents",
        "minus the damping",
        "-0.2",
        SHARP,
        lambda: duffing()[2],
    ),
    Known(
        "housner-1963",
        "let go at 0.6: p times the time of the first impact",
        HOUSNER,
        "1.566799236972",
        SHARP,
        lambda: float(rocking().contacts[0].t_in),
    ),
    *(
        Known(
            "housner-1963",
            f"let go at 0.6, r = 0.81: largest angle after {impacts} impact{'s' if impacts > 1 else ''}",
            HOUSNER,
            printed,
            SHARP,
            lambda impacts=impacts: rocking_angle(impacts),
        )
        for impacts, printed in ((1, "0.434668238996"), (2, "0.330017910687"), (5, "0.159101605236"))
    ),
    *(
        Known(
            "den-hartog-1931",
            f"w = {omega}, F = 0.5: amplitude of the motion without stops",
            DEN_HARTOG,
            printed,
            SHARP,
            lambda omega=omega: dry_amplitude(0.5, omega),
        )
        for omega, printed in ((0.7, "0.819974135042"), (1.4, "0.270684438460"))
    ),
    *(
        Known(
            "den-hartog-1931",
            f"w = {omega}: F below which the mass sticks",
            DEN_HARTOG,
            printed,
            SHARP,
            lambda omega=omega: sticking(omega, FRICTION, 0.3, 2.0),
        )
        for omega, printed in ((0.42, "1.633144255304"), (0.7, "0.415471622602"), (1.4, "0.451735887038"))
    ),
    Known(
        "den-hartog-1931",
        "w = 0.7, static friction 0.45: F below which the mass sticks",
        SHAW_FRICTION,
        "0.542667268742",
        SHARP,
        lambda: sticking(0.7, 0.45, 0.3, 2.0),
    ),
    Known(
        "den-hartog-1931",
        "w = 0.7, F = 0.5: product of the multipliers",
        DEN_HARTOG,
        "0.021036639786",
        SHARP,
        dry_product,
    ),
    Known(
        "den-hartog-1931",
        "F = 0, let go at 1: displacement at rest",
        "Lorenz (1924), formula",
        "-0.2",
        SHARP,
        left_at_rest,
    ),
    *(
        Known(
            "impact-pair",
            f"w = 1, one impact at each stop in a period: A of the {kind}",
            PAIR,
            printed,
            SHARP,
            lambda kind=kind, start=start: two_stops("impact-pair", 1.0, *start, kind),
        )
        for kind, printed, start in (
            ("fold", "0.207584130386", (0.20862, 0.0174, (-0.20737, 0.6449))),
            ("pitchfork", "0.769240969485", (0.76539, 0.827, (-0.35599, 0.39041))),
        )
    ),
    Known(
        "impact-pair",
        "w = 1, A = 0.5, one impact at each stop in a period: product of the multipliers",
        PAIR,
        "0.0625",
        SHARP,
        lambda: two_stops_product("impact-pair", 1.0, 0.5, 0.8514, (-0.29749, 0.49059)),
    ),
    *(
        Known(
            "shaw-1985",
            f"w = {omega}, one impact at each stop in a period: F of the {kind}",
            SHAW_STOPS,
            printed,
            SHARP,
            lambda omega=omega, kind=kind, start=start: two_stops("shaw-1985", omega, *start, kind),
        )
        for omega, kind, printed, start in (
            (1.5, "fold", "0.195487104485", (0.19646, 0.99, (-0.05219, 1.15355))),
            (1.5, "pitchfork", "1.939830051794", (1.93013, 0.772, (-0.13071, 0.63229))),
            (2.6, "fold", "0.608338280822", (0.61138, 0.9938, (-0.06936, 1.75958))),
            (2.6, "pitchfork", "5.046716002264", (5.02148, 0.779, (-0.1283, 1.04549))),
        )
    ),
    Known(
        "shaw-1985",
        "w = 1.5, one impact at each stop in a period: product of the multipliers",
        SHAW_STOPS,
        "0.269428231709",
        SHARP,
        lambda: two_stops_product("shaw-1985", 1.5, 1.93013, 0.772, (-0.13071, 0.63229)),
    ),
    Known(
        "shaw-1985",
        "w = 1.5, without impact: F of the grazing of both stops",
        SHAW_STOPS,
        "1.258967831201",
        SHARP,
        lambda: grazing("shaw-1985", 1.5, 0.6, (0.5, 1.4)),
    ),
    Known(
        "dankowicz-schilder-2013",
        "w = 1: A of the grazing",
        RECIPES,
        "0.1",
        SHARP,
        lambda: grazing("dankowicz-schilder-2013", 1.0, 0.05, (0.02, 0.5)),
    ),
)


def main() -> None:
    """Compute all known results and write the table."""
    rows: list[list[Cell]] = []
    for case in CASES:
        ours = case.compute()
        off = ours - float(case.expected)
        rows.append(
            [case.hammer, case.what, case.source, case.expected, ours, off, abs(off) <= case.tolerance]
        )
    columns = [
        Column(name="oscillator"),
        Column(name="what"),
        Column(name="source"),
        Column(name="known"),
        Column(name="ours", format=".12g"),
        Column(name="difference", format=".1e"),
        Column(name="within tolerance"),
    ]
    hammers = tuple(sorted({case.hammer for case in CASES}))
    write("known-results", columns, rows, {"exponents": 50_000}, ROOMS, hammers=hammers)


if __name__ == "__main__":
    main()
