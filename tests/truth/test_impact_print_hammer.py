"""The idealised hammer of Tung and Shaw against an independent, piecewise closed form.

Between impacts the equation of motion is linear with constant coefficients,

    m x'' + C x' + K x = P + A sin(w t + phi),

so that x is the sum of a constant P/K, of the imaginary part of X exp(i(w t + phi)) with
X = A / (K - m w^2 + i C w), and of two exponentials whose rates solve m s^2 + C s + K = 0: real ones off the
paper, where K is negative, complex ones on it. Pieces end at the end of a pulse, at the front of the paper,
where spring and dashpot of the paper would begin to pull, and at the backstop, where the velocity turns to
-e v. Ends are bracketed on a fine grid and refined by bisection to the last bit.
"""

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest

import printhammer as ph

SHARP = 1e-9
SLOW = 1e-2
"""Speed, m/s, below which bounces are not followed: a flight is then long beside the step of the grid."""
GRID = 2000
"""Points of the grid on which the end of a piece is bracketed."""

State = tuple[float, float]


@dataclass(frozen=True)
class Piece:
    """A motion in closed form from the time `start` onward."""

    start: float
    end: float
    at: Callable[[float], State]


@dataclass
class Hammer:
    """Plain numbers, SI; the backstop is at 0. The times of touches and of leaving the paper are kept."""

    mass: float
    preload: float
    stiffness: float
    restitution: float
    front: float
    pack_stiffness: float
    pack_damping: float
    amplitude: float
    width: float
    touches: list[tuple[str, float, float]] = field(default_factory=list)
    leaves: list[tuple[float, float]] = field(default_factory=list)

    def flight(
        self, start: float, state: State, pulse: float | None, paper: bool
    ) -> Callable[[float], State]:
        """Solution from an initial state; `pulse` is the time of the active firing."""
        damping = self.pack_damping if paper else 0.0
        stiffness = self.stiffness + (self.pack_stiffness if paper else 0.0)
        constant = self.preload + (self.pack_stiffness * self.front if paper else 0.0)
        still, omega = constant / stiffness, math.pi / self.width
        force = self.amplitude if pulse is not None else 0.0
        gain = force / (stiffness - self.mass * omega**2 + 1j * damping * omega)
        root = cmath.sqrt(damping**2 - 4.0 * self.mass * stiffness)
        first, second = (-damping + root) / (2.0 * self.mass), (-damping - root) / (2.0 * self.mass)
        swing = gain * cmath.exp(1j * omega * (start - (pulse or 0.0)))
        x, v = state[0] - still - swing.imag, state[1] - (1j * omega * swing).imag
        b = (v - first * x) / (second - first)
        a = x - b

        def at(t: float) -> State:
            one, two = a * cmath.exp(first * (t - start)), b * cmath.exp(second * (t - start))
            wave = gain * cmath.exp(1j * omega * (t - (pulse or 0.0)))
            return (
                still + wave.imag + (one + two).real,
                (1j * omega * wave).imag + (first * one + second * two).real,
            )

        return at

    def push(self, state: State) -> float:
        """Return the force of spring and dashpot of the paper."""
        return self.pack_stiffness * (state[0] - self.front) + self.pack_damping * state[1]

    def take_off(self) -> float:
        """Time after a firing at which the force overcomes the holding force."""
        return math.asin(-self.preload / self.amplitude) * self.width / math.pi

    def pieces(
        self, fired: list[float], end: float, slowest: float, begin: State | None = None
    ) -> list[Piece]:
        """Motion from rest at the backstop until the end or an impact there slower than `slowest`.

        Or from a state in flight at the first firing. Pulses do not overlap, and the armature never rests at
        the backstop between.
        """
        found: list[Piece] = []
        time, state, paper, spent = fired[0] + self.take_off(), (0.0, 0.0), False, False
        if begin is not None:
            time, state = fired[0], begin
        while time < end:
            pulse = next((t for t in fired if t <= time < t + self.width), None)
            limits = [t for t in (*fired, *(t + self.width for t in fired), end) if t > time]
            at = self.flight(time, state, pulse, paper)
            stop, why = self.ends(at, time, min(limits), paper, spent)
            found.append(Piece(time, stop, at))
            time, state = stop, at(stop)
            if why == "backstop":
                self.touches.append((why, time, state[1]))
                if -state[1] < slowest:
                    break
                state = (0.0, -self.restitution * state[1])
            elif why == "pack":
                self.touches.append((why, time, state[1]))
                state, paper = (self.front, state[1]), True
            elif why == "let go":
                self.leaves.append((time, state[1]))
                paper, spent = False, True
            elif why == "out of the paper":
                state, spent = (self.front, state[1]), False
        return found

    def ends(
        self, at: Callable[[float], State], start: float, limit: float, paper: bool, spent: bool
    ) -> tuple[float, str]:
        """Return the end time of a piece, and the reason for the end."""
        tests: dict[str, Callable[[float], float]]
        if paper:
            tests = {"let go": lambda t: self.push(at(t))}
        elif spent:
            tests = {"out of the paper": lambda t: at(t)[0] - self.front}
        else:
            tests = {"backstop": lambda t: at(t)[0], "pack": lambda t: self.front - at(t)[0]}
        first = (limit, "")
        for why, test in tests.items():
            times = start + (limit - start) * np.linspace(1e-4, 1.0, GRID)
            below = next((i for i, t in enumerate(times) if test(t) < 0.0), None)
            if below is None:
                continue
            low, high = (times[below - 1] if below else start), times[below]
            while low < (middle := 0.5 * (low + high)) < high:
                low, high = (low, middle) if test(middle) < 0.0 else (middle, high)
            if high < first[0]:
                first = (float(high), why)
        return first


def plain(hammer: "ph.Hammer") -> Hammer:
    si = {key: constant.si for key, constant in hammer.constants.items()}
    assert si["backstop.position"] == 0.0
    return Hammer(
        si["mass"],
        si["spring.preload"],
        si["spring.stiffness"],
        si["backstop.restitution"],
        si["pack.front"],
        si["pack.stiffness"],
        si["pack.damping"],
        si["waveform.amplitude"],
        si["waveform.width"],
    )


def compared(hammer: "ph.Hammer", fired: list[float], end: float, slowest: float) -> Hammer:
    """Compare displacements, velocities and touches of a run with the closed form; return the closed form."""
    exact = plain(hammer)
    pieces = exact.pieces(fired, end, slowest)
    times = np.linspace(pieces[0].start, pieces[-1].end, 1500)[1:-1]
    motion = ph.simulate(
        hammer, ph.PulseTrain(hammer.waveform, at=fired), duration=end, times=times, tolerance=1e-13
    )
    assert motion.ok
    which = np.searchsorted([piece.start for piece in pieces], times, side="right") - 1
    x, v = np.array([pieces[i].at(t) for i, t in zip(which, times, strict=True)]).T
    fastest = np.abs(v).max()
    np.testing.assert_allclose(motion.x, x, atol=SHARP * exact.front, rtol=0.0)
    np.testing.assert_allclose(motion.at(times)[1], v, atol=SHARP * fastest, rtol=0.0)
    touched = [c for c in motion.contacts if not c.initial][: len(exact.touches)]
    assert [c.surface for c in touched] == [surface for surface, _, _ in exact.touches]
    np.testing.assert_allclose([c.t_in for c in touched], [t for _, t, _ in exact.touches], rtol=SHARP)
    np.testing.assert_allclose(
        [c.v_in for c in touched], [v for _, _, v in exact.touches], atol=SHARP * fastest, rtol=0.0
    )
    return exact


@pytest.fixture(scope="module")
def hammer() -> "ph.Hammer":
    return ph.load("tung-shaw-1988")


def test_every_number_of_the_file_is_ours(hammer: "ph.Hammer") -> None:
    assert {constant.status for constant in hammer.constants.values()} == {"assumed"}
    laws = {role: part.law for role, part in hammer.parts.items()}
    assert laws == {"spring": "preload", "pack": "dashpot", "backstop": "rigid"}
    assert hammer.constants["spring.stiffness"].si < 0.0
    assert hammer.waveform is not None
    assert (hammer.waveform.shape, hammer.waveform.quantity) == ("half-sine", "force")


def test_it_is_held_at_its_backstop_and_cannot_stay_at_the_paper(hammer: "ph.Hammer") -> None:
    exact = plain(hammer)
    assert exact.preload < 0.0
    # Hold left over at the deepest indentation of a pulse.
    motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform))
    assert motion.dots[0].struck
    assert exact.preload - exact.stiffness * motion.x.max() < 0.0


def test_one_pulse(hammer: "ph.Hammer") -> None:
    exact = compared(hammer, [0.0], 4e-3, slowest=SLOW)
    assert [surface for surface, _, _ in exact.touches[:3]] == ["pack", "backstop", "backstop"]
    assert len(exact.touches) > 10
    assert len(exact.leaves) == 1


@pytest.mark.parametrize(
    "changes",
    [
        {"backstop.restitution": 0.9},
        {"pack.damping": 0.0},
        {"pack.damping": "30 N s/m"},
        {"spring.stiffness": "-20 N/mm"},
        {"waveform.amplitude": "7 N"},
    ],
    ids=str,
)
def test_one_pulse_of_other_hammers(hammer: "ph.Hammer", changes: dict[str, object]) -> None:
    exact = compared(hammer.replace(changes), [0.0], 3e-3, slowest=SLOW)
    assert exact.touches[0][0] == "pack"


def test_two_pulses(hammer: "ph.Hammer") -> None:
    # The second pulse meets the armature between two of its bounces.
    exact = compared(hammer, [0.0, 1.2e-3], 2.4e-3, slowest=SLOW)
    assert [surface for surface, _, _ in exact.touches].count("pack") == 2


def closed_orbit(exact: Hammer, period: float, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """State at the firings of the orbit near a state, and its multipliers, by Newton's method."""

    def image(start: np.ndarray) -> np.ndarray:
        last = exact.pieces([0.0], period, 0.0, (start[0], start[1]))[-1]
        assert last.end == period
        return np.array(last.at(period))

    scale = np.array([exact.front, 1.0])
    for _ in range(8):
        columns = [
            (image(state + step) - image(state - step)) / (2.0 * step.max()) for step in np.diag(1e-6 * scale)
        ]
        slope = np.array(columns).T
        change = np.linalg.solve(slope - np.eye(2), state - image(state))
        if np.abs(change / scale).max() < 1e-12:
            break
        state = state + change
    return state, np.linalg.eigvals(slope)


@pytest.mark.slow
def test_an_orbit_doubles_its_period_where_the_closed_form_does(hammer: "ph.Hammer") -> None:
    branch = ph.continuation(hammer, "period", ("1.450 ms", "1.457 ms"), period="1.452 ms")
    (event,) = branch.events
    assert event.kind == "period doubling"
    exact = plain(hammer)
    scale = np.array([exact.front, 1.0])
    state, multipliers = closed_orbit(exact, event.value, event.state)
    np.testing.assert_allclose(event.state / scale, state / scale, atol=SHARP)
    np.testing.assert_allclose(sorted(event.multipliers.real), sorted(multipliers), atol=1e-6)
    # The multiplier passes -1 within a part 1e-6 of the period to either side.
    before, after = (
        closed_orbit(exact, (1.0 + part) * event.value, event.state)[1].min() for part in (-1e-6, 1e-6)
    )
    assert after < -1.0 < before


def test_it_rests_after_infinitely_many_bounces_in_a_finite_time(hammer: "ph.Hammer") -> None:
    # Near the backstop the pull is a = P / m; bounces end 2 e v / (a (1 - e)) after a touch at speed v, but
    # for the change of the pull over a bounce, a part K v^2 m / P^2 of it.
    exact = plain(hammer)
    exact.pieces([0.0], 4e-3, slowest=SLOW)
    _, last, speed = exact.touches[-1]
    e, pull = exact.restitution, -exact.preload / exact.mass
    end = last + 2.0 * e * -speed / (pull * (1.0 - e))
    motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform), duration=4e-3, tolerance=1e-12)
    final = motion.contacts[-1]
    assert final.surface == "backstop"
    assert final.t_in + 2.0 * e * -final.v_in / (pull * (1.0 - e)) == pytest.approx(end, rel=1e-7)
    x, v = motion.at(np.linspace(1.000001 * end, 4e-3, 50))
    np.testing.assert_array_equal(x, 0.0)
    np.testing.assert_array_equal(v, 0.0)
