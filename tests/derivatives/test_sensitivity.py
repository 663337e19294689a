"""The table of sensitivities: contents, consistency, and reasons for omitted constants."""

import math

import numpy as np
import pytest
from tests.errors import refused
from tests.hammers import block, hertz, interpreted, made_of, power, preload

import printhammer as ph
from printhammer.derivatives.parameters import parameter_names, parameters
from printhammer.derivatives.sensitivities import Sensitivities


@pytest.fixture(scope="module")
def single(hammer: "ph.Hammer") -> Sensitivities:
    return ph.sensitivities(hammer, ph.PulseTrain(hammer.waveform))


def test_values_are_those_of_the_motion(hammer: "ph.Hammer", single: Sensitivities) -> None:
    motion = ph.simulate(hammer, single.drive, tolerance=single.tolerance, points=2)
    (dot,) = motion.dots
    told = dict(zip(single.quantities, single.dots[0], strict=True))
    for name in ("flight_time", "impact_speed", "peak_force", "indentation", "contact_time", "net_loss"):
        assert told[name] == getattr(dot, name)
    back = next(
        contact for contact in motion.contacts if contact.surface == "backstop" and contact.t_in > 0.0
    )
    assert told["return_time"] == back.t_in
    assert told["return_speed"] == -back.v_in
    energy = dict(zip(single.run_quantities, single.run, strict=True))
    assert energy["coil_work"] == motion.energy.coil_work
    assert (single.status, single.ok, single.smooth, single.lost) == ("ok", True, True, ())
    assert single.duration == motion.end


def test_the_constants_are_those_of_the_file_and_the_pulse(
    hammer: "ph.Hammer", single: Sensitivities
) -> None:
    assert set(single.constants) == set(hammer.constants)
    assert single.values[single.constants.index("pack.front")] == hammer.front
    # Nothing hangs on where the platen is, and nothing of the dot on how the current ends.
    assert not single.derivatives[..., single.constants.index("platen")].any()
    flight = single.derivatives[0, single.quantities.index("flight_time")]
    assert flight[single.constants.index("waveform.width")] == 0.0
    # Current and Bm come in as their product only.
    columns = [single.constants.index(name) for name in ("magnet.Bm", "waveform.amplitude")]
    first, second = (np.r_[single.logarithmic[0, :, k], single.run_logarithmic[0, k]] for k in columns)
    np.testing.assert_allclose(first, second, rtol=1e-9)


def test_a_column_does_not_depend_on_the_others(hammer: "ph.Hammer", single: Sensitivities) -> None:
    """Bit-identical."""
    for name in ("pack.front", "waveform.rise"):
        alone = ph.sensitivities(hammer, single.drive, constants=[name])
        column = single.constants.index(name)
        np.testing.assert_array_equal(alone.derivatives[..., 0], single.derivatives[..., column])
        np.testing.assert_array_equal(alone.run_derivatives[:, 0], single.run_derivatives[:, column])


def test_the_rate_is_the_inverse_of_the_period(hammer: "ph.Hammer") -> None:
    drive = ph.PulseTrain(hammer.waveform, rate="700 Hz", pulses=2)
    found = ph.sensitivities(hammer, drive, constants=["period", "rate"])
    assert found.values[0] * found.values[1] == pytest.approx(1.0, rel=1e-15)
    np.testing.assert_allclose(found.logarithmic[1, :, 1], -found.logarithmic[1, :, 0], rtol=1e-12)
    # Nothing of the first dot hangs on when the second firing is, but what follows it.
    assert not found.derivatives[0, : found.quantities.index("return_time")].any()


def test_firing_later_as_a_whole_changes_no_dot(hammer: "ph.Hammer") -> None:
    drive = ph.PulseTrain(hammer.waveform, at=[0.2e-3, 1.7e-3])
    found = ph.sensitivities(hammer, drive, constants=["firing.0", "firing.1"])
    together = found.derivatives.sum(axis=-1)
    size = np.abs(found.derivatives).max(axis=-1)
    assert (np.abs(together)[1] <= 1e-7 * size[1]).all()
    assert (np.abs(together)[0] <= 1e-9 * np.abs(found.dots[0]) / 1e-4).all()


def test_a_lost_dot_has_none(hammer: "ph.Hammer") -> None:
    weak = hammer.waveform.scaled(0.2)
    found = ph.sensitivities(hammer, ph.PulseTrain(weak))
    assert found.lost == (0,)
    assert np.isnan(found.dots).all()
    assert np.isnan(found.derivatives).all()
    assert np.isnan(found.logarithmic).all()
    # The run as a whole still has its energies.
    assert np.isfinite(found.run_derivatives).all()
    assert "0 of 1 dots struck" in repr(found)
    with refused("dot"):
        found.plot()


def test_a_constant_that_is_zero_has_an_absolute_derivative_only(hammer: "ph.Hammer") -> None:
    without = hammer.replace("backstop.damping", 0.0)
    found = ph.sensitivities(without, ph.PulseTrain(hammer.waveform), constants=["backstop.damping", "mass"])
    return_speed = found.quantities.index("return_speed")
    assert np.isnan(found.logarithmic[..., 0]).all()
    assert np.isfinite(found.logarithmic[..., 1]).all()
    assert found.derivatives[0, return_speed, 0] != 0.0
    # Against a small damping.
    little = 1e3
    other = ph.sensitivities(
        hammer.replace("backstop.damping", little), ph.PulseTrain(hammer.waveform), constants=["mass"]
    )
    slope = (other.dots - found.dots)[0, return_speed] / little
    assert found.derivatives[0, return_speed, 0] == pytest.approx(slope, rel=1e-4)
    with refused("spreads"):
        found.spread({"backstop.damping": 0.01})


def test_a_sharp_edge_is_left_out_and_said() -> None:
    """The pulse is not differentiable at a rise time of zero, since its shape changes there."""
    hammer = made_of(spring=preload(-4.0), pack=power(), backstop=hertz(damping=4e8))
    drive = block(14.0, 0.35e-3)
    with interpreted():
        found = ph.sensitivities(hammer, drive, duration=1e-3)
        assert set(found.left_out) == {"waveform.rise", "waveform.decay"}
        assert "waveform.rise" not in found.constants
        with refused("constant"):
            ph.sensitivities(hammer, drive, constants=["waveform.rise"])
    assert "waveform.rise" in found.attributes["left_out"]


def test_a_run_that_does_not_get_there_says_so() -> None:
    push = block(50.0, 1.0)
    with interpreted():
        found = ph.sensitivities(made_of(spring=preload(1.0)), push, state=(0.0, 0.0), duration=10.0)
    assert (found.status, found.ok) == ("runaway", False)
    assert np.isnan(found.run_derivatives).all()


def test_spreads_add_up(single: Sensitivities) -> None:
    given = {"magnet.Am": 0.01, "spring.Bs": "2 %"}
    spread = single.spread(given)
    parts = np.array(
        [
            np.abs(single.logarithmic[0, :, single.constants.index(name)]) * number * single.dots[0]
            for name, number in (("magnet.Am", 0.01), ("spring.Bs", 0.02))
        ]
    )
    np.testing.assert_allclose(spread.deviation[0], np.hypot(*parts), rtol=1e-12)
    np.testing.assert_allclose(spread.worst[0], parts.sum(axis=0), rtol=1e-12)
    assert (spread.run_worst >= spread.run_deviation).all()


@pytest.mark.slow
def test_a_spread_is_that_of_drawn_hammers(hammer: "ph.Hammer", single: Sensitivities) -> None:
    """Compared with 400 hammers drawn within small tolerances; the sampling error is 3.5 %."""
    rng = np.random.default_rng(3)
    given = {"magnet.Am": 1e-4, "spring.Bs": 2e-4, "mass": 1e-3, "pack.thickness": 2e-3}
    values = dict(zip(single.constants, single.values, strict=True))
    flights, forces = [], []
    for _ in range(400):
        changes = {name: values[name] * (1.0 + s * rng.standard_normal()) for name, s in given.items()}
        (dot,) = ph.simulate(hammer.replace(changes), single.drive, points=2).dots
        flights.append(dot.flight_time)
        forces.append(dot.peak_force)
    spread = single.spread(given).deviation[0]
    for name, drawn in (("flight_time", flights), ("peak_force", forces)):
        assert np.std(drawn) == pytest.approx(spread[single.quantities.index(name)], rel=0.12)


def test_the_dataset(single: Sensitivities) -> None:
    table = single.to_dataset()
    assert table["derivative"].dims == ("dot", "quantity", "constant")
    value = table["logarithmic"].sel(dot=0, quantity="flight_time", constant="magnet.Am")
    assert float(value) == single.logarithmic[0, 0, single.constants.index("magnet.Am")]
    assert str(table["constant_unit"].sel(constant="magnet.Am").item()) == "N^0.5 m^0.25"
    assert table.attrs["hammer_fingerprint"] == single.hammer.fingerprint
    assert table.attrs["status"] == "ok"
    for name in table.data_vars:
        assert table[name].attrs["units"]
        assert table[name].attrs["long_name"]
    spread = single.spread({"mass": 0.01}).to_dataset()
    assert float(spread["spread"].sel(constant="mass")) == 0.01
    assert float(spread["deviation"].sel(dot=0, quantity="impact_speed")) > 0.0


def test_single_firings_are_listed_for_uneven_trains(hammer: "ph.Hammer") -> None:
    uneven = ph.PulseTrain(hammer.waveform, at=[0.0, 1e-3, 2.5e-3])
    assert parameter_names(hammer, uneven)[-2:] == ["firing.1", "firing.2"]
    even = ph.PulseTrain(hammer.waveform, period=1e-3, pulses=3)
    assert parameter_names(hammer, even)[-1] == "period"
    (middle,) = parameters(hammer, even, ["firing.1"])
    assert middle.firings.tolist() == [0.0, 1e-3, 0.0]


@pytest.mark.parametrize(
    ("call", "key"),
    [
        (lambda h, d: ph.sensitivities(h, d, constants=["pack.hardness"]), "constant"),
        (lambda h, d: ph.sensitivities(h, d, constants=["firing.7"]), "constant"),
        (lambda h, d: ph.sensitivities(h, d, constants=["firing.x"]), "constant"),
        (lambda h, d: ph.sensitivities(h, d, constants=["period"]), "constant"),
        (lambda h, d: ph.sensitivities(h, d, tolerance=0.0), "tolerance"),
        (lambda h, d: ph.sensitivities(h, d, duration="-1 ms"), "duration"),
        (lambda h, d: ph.sensitivities(h, d, state=(math.nan, 0.0)), "state"),
        (lambda h, d: ph.sensitivities(h, d).spread({"pack.hardness": 0.1}), "spreads"),
        (lambda h, d: ph.sensitivities(h, d).spread({"mass": -0.1}), "mass"),
        (lambda h, d: ph.sensitivities(h, d).spread({"mass": "a lot"}), "spreads: mass"),
        (lambda h, d: ph.sensitivities(h, d).spread({"mass": math.inf}), "spreads: mass"),
        (lambda h, d: ph.sensitivities(h, d).plot(quantities=["beauty"]), "quantity"),
        (lambda h, d: ph.sensitivities(h, d).plot(dot=1), "dot"),
        (lambda h, d: ph.sensitivities(h, d).plot(bars=0), "bars"),
        (lambda h, d: ph.sensitivities(h, d).plot(quantities=[]), "quantities"),
    ],
)
def test_bad_arguments(hammer: "ph.Hammer", call: object, key: str) -> None:
    with refused(key):
        call(hammer, ph.PulseTrain(hammer.waveform))


def test_bars_are_the_largest_sensitivities(single: Sensitivities) -> None:
    figure = single.plot(quantities=["flight_time", "pack_loss"], bars=4)
    left, right = figure.axes
    for ax, row in (
        (left, single.logarithmic[0, single.quantities.index("flight_time")]),
        (right, single.run_logarithmic[single.run_quantities.index("pack_loss")]),
    ):
        drawn = [patch.get_width() for patch in ax.patches]
        best = sorted(row, key=lambda number: -abs(number))[:4]
        assert drawn == pytest.approx(best)
        names = [label.get_text() for label in ax.get_yticklabels()]
        assert names == [single.constants[int(np.flatnonzero(row == number)[0])] for number in best]
    figure.draw_without_rendering()
