import numpy as np
import pytest

from printhammer.claims import Context, claims, judge, strobes

RANDOM = np.random.default_rng(1983)


def in_window(scaled: np.ndarray) -> np.ndarray:
    centre, half = strobes.window()
    return centre + half * scaled


@pytest.fixture
def given_panels(monkeypatch: pytest.MonkeyPatch):
    def give(panels: list[np.ndarray]) -> None:
        named = {f"{k} ms": points for k, points in enumerate(panels)}
        monkeypatch.setattr(strobes, "panels", lambda context, **options: named)

    return give


def test_strobe_points_are_the_states_at_the_firings(context: Context) -> None:
    points = strobes.strobe_points(context, 1.3e-3, 5)
    assert points.shape == (5, 2)
    assert points[0] == pytest.approx([context.rest, 0.0], abs=1e-15)
    # The second firing is too late to see what it does.
    assert points[1] == pytest.approx([column[0] for column in context.single.at(1.3e-3)], abs=1e-10)


def test_panels_are_those_of_the_paper(context: Context) -> None:
    found = strobes.panels(context)
    assert list(found) == [f"{time:.2f} ms" for time in (1.2, 1.15, 1.1, 1.05, 0.95, 0.9, 0.85, 0.8)]
    assert {points.shape for points in found.values()} == {(200, 2)}


def test_share_inside_the_window(context: Context, given_panels) -> None:
    inside = in_window(RANDOM.uniform(-1.0, 1.0, (200, 2)))
    outside = inside.copy()
    outside[:20] = in_window(np.array([1.01, 0.0]))
    given_panels([inside, outside])
    result = judge(context, claims()["poincare_window"])
    assert result.value["shares_inside"] == pytest.approx({"0 ms": 1.0, "1 ms": 0.9})
    assert result.verdict == "fails"
    assert len(result.value["outside_m_and_m_per_s"]["1 ms"]) == 20
    given_panels([inside])
    assert judge(context, claims()["poincare_window"]).verdict == "holds"


def test_points_on_the_orbit_and_anywhere(context: Context, given_panels) -> None:
    from printhammer.printing.dots.settling import touches

    start = touches(context.single)[0].t_in
    on_orbit = np.column_stack(context.single.at(RANDOM.uniform(start, start + 1e-3, 200)))
    anywhere = in_window(RANDOM.uniform(-1.0, 1.0, (2000, 2)))
    given_panels([on_orbit, anywhere])
    value = judge(context, claims()["points_on_single_pulse_orbit"]).value
    assert value["panels_on_orbit"] == 1
    assert value["ratios"]["0 ms"] < 0.01
    assert value["ratios"]["1 ms"] == pytest.approx(1.0, abs=0.1)


def test_successive_points(context: Context, given_panels) -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    slow = in_window(np.column_stack([np.cos(angle), np.sin(angle)]))
    given_panels([slow, RANDOM.permutation(slow), np.repeat(slow[:1], 200, axis=0)])
    value = judge(context, claims()["successive_points_apart"]).value
    # Neighbours on the circle against a median chord, at right angles.
    assert value["ratios"]["0 ms"] == pytest.approx(2.0 * np.sin(np.pi / 200) / np.sqrt(2.0), rel=0.02)
    assert value["ratios"]["1 ms"] == pytest.approx(1.0, abs=0.1)
    assert value["ratios"]["2 ms"] is None
    assert value["panels_apart"] == 1


def test_a_growing_cloud(context: Context, given_panels) -> None:
    _, half = strobes.window()
    rest = np.array([context.rest, 0.0])
    given_panels([rest + half * np.tile([radius, 0.0], (200, 1)) for radius in (0.1, 0.2, 0.4, 0.3)])
    value = judge(context, claims()["cloud_grows"]).value
    assert list(value["scaled_radii"].values()) == pytest.approx([0.1, 0.2, 0.4, 0.3])
    assert value["rank_correlation"] == pytest.approx(0.8)


def test_slow_trains_come_to_one_point(context: Context) -> None:
    result = judge(context, claims()["low_rate_fixed_point"])
    last = strobes.strobe_points(context, 3e-3, 60)[-2:]
    assert result.value["scaled_distances"]["3 ms"] >= np.linalg.norm(np.diff(strobes.scaled(last), axis=0))


def test_the_deepest_point_behind_the_backstop(context: Context, given_panels) -> None:
    claim = claims()["behind_the_backstop"]
    for depth, verdict in ((2.9e-6, "fails"), (3.1e-6, "holds"), (12.6e-6, "holds"), (12.8e-6, "fails")):
        before = np.array([[context.position, 0.0], [context.position + 1e-6, 0.1]])
        given_panels([before, before - [depth, 0.0]])
        result = judge(context, claim)
        assert result.value["depth_m"] == pytest.approx(depth)
        assert result.value["depths_m"] == pytest.approx({"0 ms": 0.0, "1 ms": depth}, abs=1e-15)
        assert result.verdict == verdict
