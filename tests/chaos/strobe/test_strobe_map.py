import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.hammers import CRUDE
from tests.strobe_maps import strobe_map

import printhammer as ph
from printhammer.run.regime import Regime

PERIODS = (0.6e-3, 1.05e-3, 1.3e-3)


@pytest.mark.parametrize("period", PERIODS)
def test_it_is_the_map_of_strobe_points(hammer: ph.Hammer, period: float) -> None:
    # Pulses of the fast train overlap: those before the start are under way in the map too.
    points = ph.strobe(hammer, period=period, points=12, transient=20, verdict=False, tolerance=1e-13)
    regime = Regime.of(hammer, period=period)
    scales = regime.window.half_widths
    checked = 0
    for k in range(11):
        image = strobe_map(regime, (points.x[k], points.v[k]))
        if not image.ok:
            assert image.status == "in the pack"
            assert max(points.x[k], points.x[k + 1]) > hammer.front
            continue
        checked += 1
        expected = np.array([points.x[k + 1], points.v[k + 1]])
        np.testing.assert_allclose(image.state / scales, expected / scales, rtol=0.0, atol=1e-8)
    assert checked >= 5


@given(
    x=st.floats(45e-6, 150e-6),
    v=st.floats(-0.5, 0.5),
    period=st.sampled_from(PERIODS),
    phase=st.sampled_from([0.0, 0.9]),
)
@settings(max_examples=15)
def test_two_firings_are_one_and_another(x: float, v: float, period: float, phase: float) -> None:
    regime = Regime.of(ph.load(CRUDE), period=period)
    scales = regime.window.half_widths
    once = strobe_map(regime, (x, v), phase=phase)
    twice = strobe_map(regime, (x, v), firings=2, phase=phase)
    if not (once.ok and twice.ok):
        return
    again = strobe_map(regime, once.state, phase=phase)
    spread = np.abs(again.jacobian * scales / scales[:, np.newaxis]).max()
    np.testing.assert_allclose(again.state / scales, twice.state / scales, atol=1e-9 * max(1.0, spread))
    if once.smooth and again.smooth:
        product = again.jacobian @ once.jacobian
        size = np.abs(product * scales / scales[:, np.newaxis]).max()
        gap = np.abs((product - twice.jacobian) * scales / scales[:, np.newaxis]).max()
        assert gap <= 1e-6 * max(1.0, size, spread)


@pytest.mark.parametrize("period", PERIODS)
def test_the_derivative_is_that_of_neighbouring_images(hammer: ph.Hammer, period: float) -> None:
    regime = Regime.of(hammer, period=period)
    scales = regime.window.half_widths
    state = np.array([60e-6, 0.2])
    image = strobe_map(regime, state)
    columns = []
    for spacing in 1e-5 * scales * np.eye(2):
        near, far = (
            strobe_map(regime, state + k * spacing).state - strobe_map(regime, state - k * spacing).state
            for k in (1.0, 2.0)
        )
        columns.append((8.0 * near - far) / (12.0 * spacing.sum()))
    found = image.jacobian * scales / scales[:, np.newaxis]
    expected = np.column_stack(columns) * scales / scales[:, np.newaxis]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())


def test_contacts_are_left_out_where_not_wanted(hammer: ph.Hammer) -> None:
    regime, state = Regime.of(hammer, period=PERIODS[0]), (45e-6, -0.3)
    bare = strobe_map(regime, state, contacts=False)
    assert np.array_equal(bare.state, strobe_map(regime, state).state)
    assert bare.contacts == ()
    assert np.isnan(bare.margin)


def test_contacts_are_those_of_the_motion(hammer: ph.Hammer) -> None:
    regime = Regime.of(hammer, period=1.3e-3)
    image = strobe_map(regime, (60e-6, 0.2))
    train = ph.PulseTrain(hammer.waveform, period=1.3e-3, pulses=1)
    motion = ph.simulate(hammer, train, duration=1.3e-3, state=(60e-6, 0.2))
    expected = [(contact.surface, contact.t_in) for contact in motion.contacts if not contact.initial]
    assert [surface for surface, _t in image.contacts] == [surface for surface, _t in expected]
    np.testing.assert_allclose([t for _s, t in image.contacts], [t for _s, t in expected], atol=1e-10)


def test_the_margin_passes_zero_where_a_contact_vanishes(hammer: ph.Hammer) -> None:
    regime = Regime.of(hammer, period=1.3e-3)
    rest = (ph.rest_state(hammer), 0.0)

    def image(amplitude: float) -> tuple[int, float]:
        found = strobe_map(regime.with_("waveform.amplitude", amplitude), rest)
        return sum(surface == "pack" for surface, _t in found.contacts), found.margin

    # An armature that only just reaches the pack: so slow that nothing else is as near to a grazing.
    low, high = 0.3, regime.value("waveform.amplitude")
    assert image(low)[0] == 0
    assert image(high)[0] == 1
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if image(middle)[0] == 0 else (low, middle)
    assert -1e-6 < image(low)[1] < 0.0 < image(high)[1] < 1e-6


def test_no_image_has_a_status(hammer: ph.Hammer) -> None:
    regime = Regime.of(hammer, period=1.3e-3)
    beyond = hammer.magnet.domain[0] - 1e-6
    assert strobe_map(regime, (beyond, 0.0)).status == "range left"
    inside = strobe_map(regime, (hammer.front + 10e-6, -0.1))
    assert inside.status == "in the pack"
    assert not inside.ok
    assert np.isnan(inside.state).all()
    assert np.isnan(inside.jacobian).all()


@pytest.mark.parametrize("way", [0.6, 0.9])
@pytest.mark.parametrize("beyond", [1e-4, 1e-6])
def test_the_derivative_holds_where_the_pack_is_touched_gently(
    hammer: ph.Hammer, way: float, beyond: float
) -> None:
    """The start velocity exceeds by `beyond`, m/s, the velocity at which the armature turns at the front."""
    regime = Regime.of(hammer, rate=600.0)
    x = hammer.position + way * (hammer.front - hammer.position)

    def touches(v: float) -> bool:
        return "pack" in [surface for surface, _time in strobe_map(regime, (x, v)).contacts]

    speeds = np.linspace(-4.0, 2.0, 81)
    struck = [touches(v) for v in speeds]
    place = struck.index(not struck[0])
    inside, outside = sorted(speeds[place - 1 : place + 1], key=touches, reverse=True)
    while abs(inside - outside) > 1e-12:
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if touches(middle) else (inside, middle)
    state = np.array([x, inside + math.copysign(beyond, inside - outside)])
    image = strobe_map(regime, state)
    assert image.ok
    assert touches(state[1])
    for k, scale in enumerate(regime.window.half_widths):
        side = 1e-7 * scale * np.eye(2)[k]
        ends = [strobe_map(regime, state + m * side, contacts=False).state for m in (-1.0, 1.0)]
        slope = (ends[1] - ends[0]) / (2.0 * side[k])
        assert np.abs(image.jacobian[:, k] - slope).max() < 1e-6 * np.abs(slope).max()
