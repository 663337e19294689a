"""Equilibria against closed forms and against a brute-force scan."""

import itertools
import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from printhammer.hammer.equilibrium import equilibria, release_current, rest_state
from printhammer.parts import BackstopPart, MagnetPart, PackPart, SpringPart
from printhammer.parts.backstop.hertz import HertzBackstop
from printhammer.parts.magnet.inverse_root import InverseRootMagnet
from printhammer.parts.pack.power import PowerPack
from printhammer.parts.spring.linear import LinearSpring, PreloadSpring


@dataclass(frozen=True)
class Bench:
    """A hammer composed of parts."""

    name: str = "bench"
    mass: float = 4e-4
    magnet: MagnetPart | None = None
    spring: SpringPart | None = None
    pack: PackPart | None = None
    backstop: BackstopPart | None = None
    platen: float | None = None

    @property
    def origin(self) -> float:
        return self.backstop.position if self.backstop is not None else 0.0


def spread(value: float, ratio: float) -> st.SearchStrategy[float]:
    """Draw log-uniformly around a value."""
    return st.floats(-1.0, 1.0).map(lambda power: value * ratio**power)


stiffnesses = spread(1e9, 1e3)
presses = spread(1.0, 100.0)
masses = spread(4e-4, 10.0)


@given(presses, stiffnesses, masses, st.floats(-1e-3, 1e-3))
def test_pressed_on_a_hertz_contact(press: float, k: float, mass: float, b: float) -> None:
    # P = k delta^1.5, so delta = (P/k)^(2/3); the stiffness there is 1.5 k sqrt(delta).
    stop = HertzBackstop(position=b, stiffness=k, damping=0.0)
    hammer = Bench(mass=mass, spring=PreloadSpring(preload=-press, stiffness=0.0), backstop=stop)
    delta = (press / k) ** (2.0 / 3.0)
    rest = rest_state(hammer)
    assert rest == pytest.approx(b - delta, rel=1e-14, abs=1e-14 * delta)
    (point,) = equilibria(hammer)
    assert point.x == rest
    assert point.stable
    assert point.surface == "backstop"
    # The frequency follows the depth b - x, which is rounded with x.
    rounded = 1e-10 + 4.0 * math.ulp(b) / delta
    expected = math.sqrt(1.5 * k * math.sqrt(delta) / mass) / (2.0 * math.pi)
    assert point.frequency == pytest.approx(expected, rel=rounded)


@given(presses, stiffnesses, spread(1e4, 10.0))
def test_a_spring_stiffens_the_hertz_contact(press: float, k: float, spring: float) -> None:
    stop = HertzBackstop(position=0.0, stiffness=k, damping=0.0)
    hammer = Bench(spring=PreloadSpring(preload=-press, stiffness=spring), backstop=stop)
    delta = -rest_state(hammer)
    assert k * delta**1.5 + spring * delta == pytest.approx(press, rel=1e-13)
    expected = math.sqrt((1.5 * k * math.sqrt(delta) + spring) / 4e-4) / (2.0 * math.pi)
    stable = [point for point in equilibria(hammer) if point.stable]
    assert [point.frequency for point in stable] == pytest.approx([expected], rel=1e-10)


@given(spread(2.5, 3.0), spread(14.0, 3.0), spread(51e-6, 2.0), spread(0.093, 3.0), st.floats(1.01, 3.0))
def test_release_current_of_equation_3(f0: float, bs: float, b: float, bm: float, hold: float) -> None:
    # At the backstop F0 + Bs = (Am - Bm I)^2 / sqrt(b).
    lift = math.sqrt((f0 + bs) * math.sqrt(b))
    am = hold * lift
    hammer = Bench(
        magnet=InverseRootMagnet(F0=f0, Am=am, Bm=bm),
        spring=LinearSpring(Bs=bs, As=4.66e-4),
        backstop=HertzBackstop(position=b, stiffness=1e9, damping=0.0),
    )
    assert release_current(hammer) == pytest.approx((am - lift) / bm, rel=1e-14 * am / (am - lift))


@given(spread(2.5, 3.0), spread(14.0, 3.0), spread(0.44, 1.5), st.floats(0.0, 2.0))
def test_magnet_and_spring_are_a_cubic_in_the_root_of_x(
    f0: float, bs: float, am: float, current: float
) -> None:
    # With u = sqrt(x) the net force is zero where -K u^3 + (F0 + Bs + K b) u - (Am - Bm I)^2 = 0.
    b, travel, bm = 51e-6, 4.66e-4, 0.093
    hammer = Bench(
        magnet=InverseRootMagnet(F0=f0, Am=am, Bm=bm),
        spring=LinearSpring(Bs=bs, As=travel),
        backstop=HertzBackstop(position=b, stiffness=1e9, damping=0.0),
    )
    stiffness = bs / travel
    cubic = np.polynomial.Polynomial([-((am - bm * current) ** 2), f0 + bs + stiffness * b, 0.0, -stiffness])
    powers = [complex(u) for u in cubic.roots().tolist()]
    real = [u.real for u in powers if abs(u.imag) < 1e-9 * abs(u) and u.real > 0.0]
    expected = sorted(u * u for u in real if b < u * u < 1.0)
    # Close to a fold neither side knows the two roots to many digits.
    assume(all(high / low > 1.001 for low, high in itertools.pairwise(expected)))
    found = [point for point in equilibria(hammer, current) if point.surface is None]
    assert [point.x for point in found] == pytest.approx(expected, rel=1e-9)
    # Ascending through the upper root the force turns from positive to negative: there it is stable.
    assert [point.stable for point in found] == [False, True][2 - len(found) :]
    for point in found:
        if point.stable:
            slope = 0.5 * (am - bm * current) ** 2 * point.x**-1.5 - stiffness
            expected_frequency = math.sqrt(-slope / 4e-4) / (2.0 * math.pi)
            assert point.frequency == pytest.approx(expected_frequency, rel=1e-8)


@settings(max_examples=30, deadline=None)
@given(
    spread(2.5, 4.0),
    spread(0.44, 2.0),
    spread(14.0, 4.0),
    spread(4.66e-4, 4.0),
    spread(1e9, 1e3),
    spread(260.0, 10.0),
    st.floats(-1.0, 6.0),
)
def test_no_equilibrium_is_missed(
    f0: float, am: float, bs: float, travel: float, k: float, pack: float, current: float
) -> None:
    b, front, d, platen, bm = 51e-6, 203e-6, 178e-6, 381e-6, 0.093
    hammer = Bench(
        magnet=InverseRootMagnet(F0=f0, Am=am, Bm=bm),
        spring=LinearSpring(Bs=bs, As=travel),
        pack=PowerPack(stiffness=pack, front=front, thickness=d),
        backstop=HertzBackstop(position=b, stiffness=k, damping=0.0),
        platen=platen,
    )

    def force(x: np.ndarray) -> np.ndarray:
        total: np.ndarray = f0 - (am - bm * current) ** 2 / np.sqrt(x) + bs - bs / travel * (x - b)
        return total + k * np.maximum(b - x, 0.0) ** 1.5 - pack * np.maximum((x - front) / d, 0.0) ** 2.7

    scan = np.concatenate([np.geomspace(1e-12, 1e-6, 20_000), np.linspace(1e-6, platen, 400_000)[1:]])
    values = force(scan)
    crossings = np.flatnonzero(values[:-1] * values[1:] < 0.0)
    found = np.array([point.x for point in equilibria(hammer, current)])
    for k_cell in crossings:
        inside = (found >= scan[k_cell]) & (found <= scan[k_cell + 1])
        assert inside.sum() == 1
    stable = [point.stable for point in equilibria(hammer, current) if point.x >= scan[0]]
    assert len(stable) >= len(crossings)
    for point in equilibria(hammer, current):
        below, above = force(np.array([point.x * (1.0 - 1e-7), point.x * (1.0 + 1e-7)]))
        assert (below > 0.0 > above) == point.stable
        assert abs(force(np.array([point.x]))[0]) < 1e-9


@settings(deadline=None)
@given(spread(2.5, 1.2), spread(0.44, 1.05), spread(14.3, 1.05), spread(51e-6, 1.2), spread(3e9, 5.0))
def test_the_total_force_at_rest_is_below_a_nanonewton(
    f0: float, am: float, bs: float, b: float, k: float
) -> None:
    hammer = Bench(
        magnet=InverseRootMagnet(F0=f0, Am=am, Bm=0.093),
        spring=LinearSpring(Bs=bs, As=4.66e-4),
        backstop=HertzBackstop(position=b, stiffness=k, damping=4e8),
    )
    x = rest_state(hammer)
    total = f0 - am**2 / math.sqrt(x) + bs - bs / 4.66e-4 * (x - b) + k * (b - x) ** 1.5
    assert abs(total) < 1e-10
