"""Force and flux linkage of magnets: slopes of one coenergy, an exact inverse, textbook limits."""

import math
from collections.abc import Callable
from functools import cache
from importlib import import_module
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import quad

from printhammer.parts import MagnetPart
from printhammer.parts.magnet._grid import GridMagnet
from printhammer.parts.magnet.linkage_table import LinkageTableMagnet
from printhammer.parts.magnet.moving_coil import MovingCoilMagnet
from printhammer.parts.magnet.reluctance import MU0, ReluctanceMagnet
from printhammer.parts.magnet.table import TableMagnet

STENCIL = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
"""Central differences of the eighth order."""

Law = tuple[Any, np.ndarray]


def law(part: MagnetPart) -> Law:
    return import_module(part.module), np.array(part.packed(0.0))


def slope(function: Callable[[float], float], at: float, step: float) -> float:
    pairs = enumerate(STENCIL, start=1)
    return sum(weight * (function(at + k * step) - function(at - k * step)) for k, weight in pairs) / step


def positive(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(math.log(low), math.log(high)).map(math.exp)


@st.composite
def circuits(draw: st.DrawFn, *, saturates: bool = True) -> ReluctanceMagnet:
    """Circuits whose gap closes at 0, of either pull direction, with and without fringe and leakage."""
    fringes, leaks = draw(st.booleans()), draw(st.booleans())
    area, residual = draw(positive(1e-6, 1e-3)), draw(positive(2e-5, 1e-3))
    core = {
        "core_reluctance": draw(st.floats(0.1, 3.0)) * (residual + 1e-3) / (MU0 * area),
        "saturation_flux": draw(st.floats(0.5, 2.5)) * area,
    }
    return ReluctanceMagnet(
        turns=draw(positive(20.0, 3000.0)),
        pole_area=area,
        residual_gap=residual,
        closed_at=0.0,
        fringe_perimeter=2.0 * math.sqrt(math.pi * area) * fringes,
        fringe_height=draw(positive(1e-4, 1e-2)) * fringes,
        leakage=draw(positive(1e-3, 0.1)) * leaks,
        leakage_reach=20e-3 if leaks else None,
        pull=draw(st.sampled_from(["paper", "backstop"])),
        **(core if saturates else {}),
    )


gaps = positive(1e-4, 8e-3)
drives = st.builds(lambda size, sign: size * sign, st.floats(0.05, 3.0), st.sampled_from([-1.0, 1.0]))
"""Current, in that which would saturate the core across the gap; at 0 A it has a kink of third order."""


def place(magnet: ReluctanceMagnet, gap: float, drive: float) -> tuple[float, float]:
    """Return the displacement of a gap, and a current."""
    flux = magnet.saturation_flux or 1.5 * magnet.pole_area
    drop = flux * (gap + magnet.residual_gap) / (MU0 * magnet.pole_area)
    return (-gap if magnet.pull == "paper" else gap), drive * drop / magnet.turns


@given(circuits(), gaps, drives)
def test_force_and_linkage_have_one_coenergy(magnet: ReluctanceMagnet, gap: float, drive: float) -> None:
    module, c = law(magnet)
    x, current = place(magnet, gap, drive)
    scale = abs(place(magnet, gap, 1.0)[1])
    emf = module.magnet_emf(c, x, current)
    largest = abs(module.magnet_emf(c, x, 0.5 * scale)) + abs(emf)
    # A good core has a sharp knee, against which steps must be small.
    knee = 0.003 * min(1.0, magnet.core_reluctance * MU0 * magnet.pole_area / gap)
    along_current = slope(lambda i: module.magnet_force(c, x, i), current, knee * abs(current))
    along_x = slope(lambda s: module.magnet_linkage(c, s, current), x, knee * gap)
    assert along_current == pytest.approx(emf, abs=1e-9 * largest)
    assert along_x == pytest.approx(emf, abs=1e-9 * largest)
    inductance = slope(lambda i: module.magnet_linkage(c, x, i), current, knee * abs(current))
    assert inductance == pytest.approx(
        module.magnet_inductance(c, x, current), abs=1e-9 * module.magnet_inductance(c, x, 0.0)
    )


@given(circuits(), gaps, drives)
def test_the_force_is_the_slope_of_the_coenergy_of_the_linkage(
    magnet: ReluctanceMagnet, gap: float, drive: float
) -> None:
    module, c = law(magnet)
    x, current = place(magnet, gap, drive)
    work = quad(lambda i: module.magnet_emf(c, x, i), 0.0, current, epsabs=0.0, epsrel=1e-10, limit=200)[0]
    assert module.magnet_force(c, x, current) == pytest.approx(work, rel=1e-8, abs=1e-300)


@given(circuits(), gaps, drives, st.sampled_from([0.0, 1e-6, 1e-3, 1.0]))
def test_the_inverse_comes_back(
    magnet: ReluctanceMagnet, gap: float, drive: float, inductance: float
) -> None:
    module, c = law(magnet)
    x, current = place(magnet, gap, drive)
    linkage = module.magnet_linkage(c, x, current) + inductance * current
    # What a rounding of the linkage does to the current.
    rise = module.magnet_inductance(c, x, current) + inductance
    assert rise > 0.0
    back = module.magnet_current(c, x, linkage, inductance)
    assert back == pytest.approx(current, rel=1e-13, abs=4e-16 * abs(linkage) / rise + 1e-300)
    again = module.magnet_linkage(c, x, back) + inductance * back
    assert again == pytest.approx(linkage, rel=1e-13, abs=1e-300)


@given(circuits(saturates=False), gaps, drives)
def test_without_saturation_the_force_is_that_of_the_inductance(
    magnet: ReluctanceMagnet, gap: float, drive: float
) -> None:
    module, c = law(magnet)
    x, current = place(magnet, gap, drive)
    rise = slope(lambda s: module.magnet_inductance(c, s, current), x, 3e-3 * gap)
    assert module.magnet_force(c, x, current) == pytest.approx(0.5 * current * current * rise, rel=1e-9)
    assert module.magnet_linkage(c, x, current) == pytest.approx(
        module.magnet_inductance(c, x, 0.3) * current, rel=1e-13
    )


@given(circuits(), gaps)
def test_the_core_holds_the_flux(magnet: ReluctanceMagnet, gap: float) -> None:
    assume(magnet.leakage == 0.0)
    module, c = law(magnet)
    x, current = place(magnet, gap, 1e6)
    assert magnet.saturation_flux is not None
    limit = magnet.turns * magnet.saturation_flux
    assert module.magnet_linkage(c, x, current) == pytest.approx(limit, rel=1e-4)
    assert module.magnet_linkage(c, x, -current) == -module.magnet_linkage(c, x, current)
    assert math.isnan(module.magnet_current(c, x, 1.01 * limit, 0.0))


def test_the_textbook_gap() -> None:
    # 1000 turns, 1 cm^2, 1 mm: L = mu0 N^2 A / g = 0.04 pi H, F = L i^2 / (2 g) = 20 pi N at 1 A.
    pulls = {"paper": (-1e-3, 1.0), "backstop": (1e-3, -1.0)}
    for pull, (x, sign) in pulls.items():
        module, c = law(ReluctanceMagnet(turns=1000.0, pole_area=1e-4, closed_at=0.0, pull=pull))
        assert module.magnet_linkage(c, x, 2.0) == pytest.approx(0.08 * math.pi, rel=1e-12)
        assert module.magnet_inductance(c, x, 2.0) == pytest.approx(0.04 * math.pi, rel=1e-12)
        assert module.magnet_force(c, x, -1.0) == pytest.approx(sign * 20.0 * math.pi, rel=1e-12)
        assert module.magnet_emf(c, x, 1.0) == pytest.approx(sign * 40.0 * math.pi, rel=1e-12)
        assert module.magnet_energy(c, x) == 0.0
        assert all(math.isnan(module.magnet_force(c, at, 1.0)) for at in (0.0, -x))


def test_the_range_of_the_circuit() -> None:
    ends = {"paper": (-4e-3, 6e-3), "backstop": (4e-3, 14e-3)}
    for pull, domain in ends.items():
        magnet = ReluctanceMagnet(
            turns=100.0,
            pole_area=1e-4,
            closed_at=5e-3,
            residual_gap=1e-3,
            leakage=1e-3,
            leakage_reach=9e-3,
            pull=pull,
        )
        module, c = law(magnet)
        assert magnet.domain == pytest.approx(domain)
        inside = np.linspace(domain[0] + 1e-6, domain[1] - 1e-6, 9)
        assert all(math.isfinite(module.magnet_force(c, x, 1.0)) for x in inside)
        assert all(math.isnan(module.magnet_energy(c, x)) for x in (domain[0] - 1e-6, domain[1] + 1e-6))


def test_a_moving_coil_gives_back_what_it_takes() -> None:
    module, c = law(MovingCoilMagnet(constant=-4.0))
    assert module.magnet_force(c, 0.3, 2.0) == -8.0
    assert module.magnet_linkage(c, 0.25, 2.0) == -1.0
    assert module.magnet_emf(c, 0.25, 2.0) == -4.0
    assert module.magnet_current(c, 0.25, -1.0 + 0.5 * 2.0, 0.5) == 2.0
    assert math.isnan(module.magnet_current(c, 0.25, -1.0, 0.0))


KNOTS = (1e-4, 1.5e-4, 2.5e-4, 3e-4, 4.5e-4, 6e-4)
CURRENTS = (-0.5, 0.0, 0.4, 1.0, 1.5, 2.0)
TABLES: list[type[GridMagnet]] = [TableMagnet, LinkageTableMagnet]


@cache
def table_of(kind: type[GridMagnet], seed: int) -> MagnetPart:
    """Return a table of a circuit, with noise."""
    noise = np.random.default_rng(seed).normal(0.0, 1e-2, (len(KNOTS), len(CURRENTS)))
    x, current = np.array(KNOTS)[:, None], np.array(CURRENTS)
    if kind is TableMagnet:
        return kind.from_arrays(KNOTS, CURRENTS, 1e4 * x * current**2 + 0.1 * noise)
    return kind.from_arrays(KNOTS, CURRENTS, 1e-2 * (1.0 + 2e3 * x) * np.arctan(current) + 1e-2 * noise)


@pytest.mark.parametrize("kind", TABLES)
@given(seed=st.integers(0, 4), x=st.floats(1.01e-4, 5.99e-4), current=st.floats(-0.499, 1.999))
def test_tables_have_one_coenergy(kind: type[GridMagnet], seed: int, x: float, current: float) -> None:
    # Inside a cell both are polynomials, whose differences are exact.
    assume(min(abs(x - knot) for knot in KNOTS) > 5e-6)
    assume(min(abs(current - knot) for knot in CURRENTS) > 0.02)
    module, c = law(table_of(kind, seed))
    emf, inductance = module.magnet_emf(c, x, current), module.magnet_inductance(c, x, current)
    largest = max(abs(module.magnet_emf(c, x, i)) for i in np.linspace(-0.5, 2.0, 11))
    most = max(abs(module.magnet_inductance(c, s, i)) for i in CURRENTS for s in KNOTS)
    along_current = slope(lambda i: module.magnet_force(c, x, i), current, 0.004)
    along_x = slope(lambda s: module.magnet_linkage(c, s, current), x, 1e-6)
    assert along_current == pytest.approx(emf, abs=1e-9 * largest)
    assert along_x == pytest.approx(emf, abs=1e-9 * largest)
    rise = slope(lambda i: module.magnet_linkage(c, x, i), current, 0.004)
    assert rise == pytest.approx(inductance, abs=1e-9 * most)


@pytest.mark.parametrize("kind", TABLES)
@given(seed=st.integers(0, 4), x=st.floats(1e-4, 6e-4), current=st.floats(-0.5, 2.0))
def test_tables_are_continuous_and_inverted(
    kind: type[GridMagnet], seed: int, x: float, current: float
) -> None:
    module, c = law(table_of(kind, seed))
    for name in ("magnet_force", "magnet_linkage", "magnet_emf", "magnet_inductance"):
        of = getattr(module, name)
        for knot in KNOTS[1:-1]:
            size = max(abs(of(c, knot, i)) for i in CURRENTS)
            before = of(c, knot * (1.0 - 1e-14), current)
            assert before == pytest.approx(of(c, knot, current), abs=1e-9 * size)
        for knot in CURRENTS[1:-1]:
            size = max(abs(of(c, s, 1.9)) for s in KNOTS)
            assert of(c, x, knot - 1e-14) == pytest.approx(of(c, x, knot), abs=1e-9 * size)
    # A table of forces lacks the inductance at its beginning, of which its noise asks for some.
    for inductance in (0.1, 1.0) if kind is TableMagnet else (0.0, 1e-3, 1.0):
        linkage = module.magnet_linkage(c, x, current) + inductance * current
        back = module.magnet_current(c, x, linkage, inductance)
        assert back == pytest.approx(current, rel=1e-13, abs=1e-13)
    assert math.isnan(module.magnet_current(c, x, 1e3, 0.1))
    assert math.isnan(module.magnet_current(c, 0.9 * KNOTS[0], 0.0, 0.1))


def test_tables_of_a_circuit_give_force_and_linkage_back() -> None:
    magnet = ReluctanceMagnet(
        turns=500.0,
        pole_area=5e-5,
        residual_gap=2e-4,
        closed_at=3e-3,
        core_reluctance=4e5,
        saturation_flux=9e-5,
    )
    module, c = law(magnet)
    x, current = np.linspace(0.0, 2.5e-3, 41), np.linspace(0.0, 3.0, 41)
    linkages = [[module.magnet_linkage(c, a, i) for i in current] for a in x]
    forces = [[module.magnet_force(c, a, i) for i in current] for a in x]
    by_linkage, d = law(LinkageTableMagnet.from_arrays(x, current, linkages))
    by_force, e = law(TableMagnet.from_arrays(x, current, forces))
    for a in (0.03e-3, 0.7e-3, 1.9e-3, 2.45e-3):
        assert by_linkage.magnet_force(d, a, 0.0) == pytest.approx(0.0, abs=1e-15)
        for i in (0.2, 0.9, 1.7, 2.9):
            linkage, begin = module.magnet_linkage(c, a, i), module.magnet_linkage(c, 0.0, i)
            assert by_linkage.magnet_linkage(d, a, i) == pytest.approx(linkage, rel=1e-4)
            assert by_linkage.magnet_force(d, a, i) == pytest.approx(module.magnet_force(c, a, i), rel=3e-3)
            assert by_force.magnet_linkage(e, a, i) + begin == pytest.approx(linkage, rel=1e-3)
