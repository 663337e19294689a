"""Error-free measurements of the laboratory, against independent formulas."""

import mpmath
import numpy as np
import pytest
from tests import hammers
from tests.oracle.integrator import reference

import printhammer as ph

HAMMER = hammers.crude()
C = {key: constant.si for key, constant in HAMMER.constants.items()}
EXACT = {"exact": True}


def test_the_magnet_bench_shows_equations_3_and_4() -> None:
    table = ph.measure("magnet", HAMMER, sensor=EXACT).values
    x, current = table["displacement"], table["current"]
    magnet = C["magnet.F0"] - (C["magnet.Am"] - C["magnet.Bm"] * current) ** 2 / np.sqrt(x)
    spring = C["spring.Bs"] - C["spring.Bs"] / C["spring.As"] * (x - C["backstop.position"])
    np.testing.assert_allclose(table["force"], magnet + spring, rtol=1e-12, atol=1e-12)
    assert x.min() == C["backstop.position"]
    assert x.max() == C["platen"]
    assert current.min() == 0.0
    assert current.max() > C["waveform.amplitude"] * 0.99
    assert len(np.unique(current)) >= 4


def test_the_spring_bench_shows_equation_4() -> None:
    table = ph.measure("spring", HAMMER, sensor=EXACT).values
    travel = table["displacement"] - C["backstop.position"]
    np.testing.assert_allclose(table["force"], C["spring.Bs"] * (1.0 - travel / C["spring.As"]), rtol=1e-12)


def test_the_pack_bench_shows_both_branches_of_equation_5() -> None:
    measured = ph.measure("pack", HAMMER, sensor=EXACT, peaks=[40e-6, 70e-6], points=20)
    r = measured.values["indentation"] / C["pack.thickness"]
    branch = np.array(measured.words["branch"])
    force = measured.values["force"] / C["pack.stiffness"]
    np.testing.assert_allclose(force[branch == "loading"], r[branch == "loading"] ** 2.7, rtol=1e-12)
    for peak, rows in ((40e-6, slice(0, 39)), (70e-6, slice(39, 78))):
        turn = peak / C["pack.thickness"]
        out = branch[rows] == "unloading"
        np.testing.assert_allclose(force[rows][out], turn**-8.3 * r[rows][out] ** 11, rtol=1e-11)
        assert measured.values["indentation"][rows].max() == pytest.approx(peak, rel=1e-15)
        np.testing.assert_array_equal(branch[rows], ["loading"] * 20 + ["unloading"] * 19)


@pytest.mark.parametrize("factor", [1e-3, 1.0, 30.0])
def test_rebounds_obey_the_exact_law(factor: float) -> None:
    """z - ln(1 + z) = -(y + ln(1 - y)), with logarithms in extended precision."""
    ratio = factor * C["backstop.damping"] / C["backstop.stiffness"]
    hammer = HAMMER.replace("backstop.damping", ratio * C["backstop.stiffness"])
    table = ph.measure("backstop", hammer, sensor=EXACT).values
    with mpmath.workdps(40):
        for v_in, v_out in zip(table["impact speed"], table["rebound speed"], strict=True):
            z, y = (mpmath.mpf(ratio) * mpmath.mpf(float(v)) for v in (v_in, v_out))
            left, right = z - mpmath.log(1 + z), -(y + mpmath.log(1 - y))
            # An error of y moves the right side by y / (1 - y) times as much.
            assert abs(left - right) * (1 - y) / y**2 < 1e-9
    undamped = ph.measure("backstop", HAMMER.replace("backstop.damping", 0.0), sensor=EXACT).values
    np.testing.assert_array_equal(undamped["impact speed"], undamped["rebound speed"])


def test_rebounds_from_other_backstops_are_those_of_the_reference() -> None:
    speeds = [0.3, 1.1]
    with hammers.interpreted():
        for law in ("rigid", "elastomer"):
            backstop = hammers.BACKSTOPS[law]
            table = ph.measure("backstop", HAMMER.replace("backstop", backstop), sensor=EXACT, speeds=speeds)
            for v_in, v_out in zip(speeds, table.values["rebound speed"], strict=True):
                bare = hammers.made_of(C["mass"], backstop=backstop)
                start = (C["backstop.position"] + 1e-6, -v_in)
                run = reference(bare, hammers.idle(), 5e-3, state=start, tolerance=1e-12)
                assert v_out == pytest.approx(run.v[-1], rel=1e-8)
            if law == "rigid":
                np.testing.assert_allclose(table.values["rebound speed"], 0.6 * np.array(speeds), rtol=1e-9)


@pytest.mark.parametrize("rate", ["1 MHz", "130 kHz"])
def test_the_sensor_is_a_first_order_low_pass(rate: str) -> None:
    """Against the response to a staircase of 20 ns steps, each of which has a closed form."""
    bandwidth, step = 80e3, 20e-9
    tau = 1.0 / (2.0 * np.pi * bandwidth)
    sensor = {"exact": True, "bandwidth": bandwidth, "sampling_rate": rate}
    table = ph.measure("motion", HAMMER, sensor=sensor, duration="1.2 ms").values
    fine = np.arange(int(1.2e-3 / step) + 1) * step
    pulse = ph.PulseTrain(HAMMER.waveform)
    motion = ph.simulate(HAMMER, pulse, duration=1.3e-3, times=fine + 0.5 * step)
    rest = ph.rest_state(HAMMER)
    kept = np.exp(-step / tau)
    t = table["time"]
    for name, inside, before in (
        ("displacement", motion.x, rest),
        ("current", HAMMER.waveform.value(fine + 0.5 * step), 0.0),
    ):
        shown = np.empty(len(fine))
        shown[0] = before
        for k in range(1, len(fine)):
            shown[k] = inside[k - 1] + (shown[k - 1] - inside[k - 1]) * kept
        wanted = np.interp(t[t >= 0.0], fine, shown)
        np.testing.assert_allclose(table[name][t >= 0.0], wanted, atol=2e-5 * np.abs(inside).max())
    # The delay is that of the sensor: one time constant behind in steady flight.
    assert np.abs(table["displacement"][t >= 0.0] - np.interp(t[t >= 0.0], fine, motion.x)).max() > 1e-7
