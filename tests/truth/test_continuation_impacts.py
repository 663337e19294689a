"""Branches and branch points of rigid impact oscillators, and of a grazing, against closed forms."""

import math

import numpy as np
import pytest
from tests.truth.impact_orbits import BouncingBall, DampedImpacts, LinearImpacts

import printhammer as ph
from printhammer.chaos.continuation.branch import Branch
from printhammer.chaos.continuation.continuation import continuation
from printhammer.chaos.curves.stability_chart import stability_chart

SHARP = 1e-8
MASS, GRAVITY, FREQUENCY = 1e-3, 9.80665, 50.0


def ball_of(case: BouncingBall) -> "ph.Hammer":
    return ph.Hammer.build(
        MASS,
        spring={"law": "preload", "preload": -MASS * case.gravity, "stiffness": 0.0},
        backstop={"law": "rigid", "position": 0.0, "restitution": case.restitution},
    )


def bounces(case: BouncingBall, gamma: float, bounds: tuple[float, float], stable: bool = True) -> Branch:
    weight = MASS * case.gravity
    return continuation(
        ball_of(case),
        "drive.amplitude",
        (bounds[0] * weight, bounds[1] * weight),
        drive=ph.SineForce(gamma * weight, case.frequency),
        state=case.state(gamma, 0.5 / case.frequency, stable),
        firings=case.n,
        phase=0.5,
    )


def values(branch: Branch, kind: str) -> list[float]:
    assert all(event.sharp for event in branch.events)
    return [event.value for event in branch.events if event.kind == kind]


def oscillator_of(case: LinearImpacts) -> "ph.Hammer":
    return ph.Hammer.build(
        1.0,
        spring={"law": "preload", "preload": -case.stop, "stiffness": 1.0},
        backstop={"law": "rigid", "position": case.stop, "restitution": case.restitution},
    )


def impacts(
    case: LinearImpacts, force: float, root: int, phase: float, bounds: tuple[float, float]
) -> Branch:
    b, angle = case.roots(force)[root]
    assert case.possible(force, b, angle)
    late = ((2.0 * math.pi * phase - angle) / case.omega) % case.period
    return continuation(
        oscillator_of(case),
        "drive.amplitude",
        bounds,
        drive=ph.SineForce(force, case.omega / (2.0 * math.pi), phase=0.5 * math.pi),
        state=case.state(force, b, angle, late),
        firings=case.n,
        phase=phase,
    )


@pytest.mark.parametrize(("restitution", "n", "gamma"), [(0.8, 1, 0.8), (0.5, 1, 1.3), (0.8, 2, 1.0)])
def test_bouncing_ball(restitution: float, n: int, gamma: float) -> None:
    case = BouncingBall(GRAVITY, restitution, FREQUENCY, n)
    branch = bounces(case, gamma, (0.5 * case.fold, 1.3 * case.doubling))
    weight = MASS * GRAVITY
    assert [stop.reason for stop in branch.stops] == ["bound", "bound"]
    assert {event.kind for event in branch.events} == {"fold", "period doubling"}
    assert values(branch, "fold") == [pytest.approx(case.fold * weight, rel=SHARP)]
    assert values(branch, "period doubling") == [pytest.approx(case.doubling * weight, rel=SHARP)]
    (limits,) = branch.stable_ranges
    assert limits == pytest.approx((case.fold * weight, case.doubling * weight), rel=SHARP)


def test_bouncing_ball_orbits_and_multipliers() -> None:
    case = BouncingBall(GRAVITY, 0.8, FREQUENCY)
    branch = bounces(case, 0.8, (0.9 * case.fold, 1.1))
    seen = set()
    for value, x, v, multipliers in zip(branch.values, branch.x, branch.v, branch.multipliers, strict=True):
        gamma = value / (MASS * GRAVITY)
        if gamma - case.fold < 1e-4:
            continue
        exact = {stable: case.state(gamma, 0.5 / FREQUENCY, stable) for stable in (True, False)}
        stable = bool(abs(x[0] - exact[True][0]) < abs(x[0] - exact[False][0]))
        seen.add(stable)
        np.testing.assert_allclose((x[0], v[0]), exact[stable], rtol=1e-8)
        assert multipliers.sum() == pytest.approx(case.trace(gamma, stable), abs=1e-6)
        assert multipliers.prod() == pytest.approx(case.restitution**2, rel=1e-8)
    assert seen == {True, False}
    assert set(branch.contacts) == {"B"}
    np.testing.assert_allclose(branch.drive_work, branch.backstop_loss, rtol=1e-7)


def test_bouncing_ball_doubled() -> None:
    case = BouncingBall(GRAVITY, 0.5, FREQUENCY)
    weight = MASS * GRAVITY
    branch = bounces(case, 1.3, (0.9 * case.fold, 1.05 * case.doubling))
    (event,) = [event for event in branch.events if event.kind == "period doubling"]
    doubled = branch.doubled(event)
    assert doubled.firings == 2
    assert doubled.stops[0].reason == "period doubling"
    assert doubled.stops[0].parameter == pytest.approx(case.doubling * weight, rel=SHARP)
    assert doubled.values[0] == pytest.approx(case.doubling * weight, rel=SHARP)
    np.testing.assert_allclose(doubled.multipliers[0].real, [1.0, case.restitution**4], atol=1e-6)
    # Supercritical: the doubled orbit is stable at first.
    assert doubled.stable[0]
    assert doubled.values[-1] == branch.bounds[1]
    # Two different flights, together two periods; both impacts leave as fast as they arrived, times e.
    assert abs(doubled.x[-1, 0] - doubled.x[-1, 1]) > 1e-5
    assert set(doubled.contacts) == {"BB"}


def test_four_doublings_lead_to_a_branch_that_does_not_jump() -> None:
    case = BouncingBall(GRAVITY, 0.5, FREQUENCY)
    weight = MASS * GRAVITY
    branch = bounces(case, 1.4, (0.9 * case.doubling, 1.18 * case.doubling))
    for _ in range(4):
        (event, *_) = [event for event in branch.events if event.kind == "period doubling"]
        branch = branch.doubled(event)
    assert (branch.firings, branch.stops[1].reason) == (16, "bound")
    sizes = branch.multipliers[:, 0].real
    # From 1 through -1 to -2e4 without a turn.
    assert (np.diff(sizes) < 0.0).all()
    assert sizes[-1] < -1e4
    for number in (len(branch) // 2, len(branch) - 1):
        orbit, push = branch.orbit(number), branch.values[number] / MASS
        impacts = [(contact.t_in, contact.v_in) for contact in orbit.contacts]
        assert len(impacts) == 16
        matrix = np.eye(2)
        omega, e = case.omega, case.restitution
        for i, (t, v) in enumerate(impacts):
            after, arrival = impacts[(i + 1) % 16]
            after += 16.0 / case.frequency if i == 15 else 0.0
            dt, up = after - t, -e * v
            turned = math.cos(omega * after) - math.cos(omega * t)
            path = push / omega**2 * (math.sin(omega * t) - math.sin(omega * after))
            y = (up + push / omega * math.cos(omega * t)) * dt - 0.5 * GRAVITY * dt * dt + path
            assert y == pytest.approx(0.0, abs=1e-12)
            assert up - GRAVITY * dt - push / omega * turned == pytest.approx(arrival, abs=1e-9)
            force = push * math.sin(omega * after) - GRAVITY
            saltation = np.array([[-e, 0.0], [(1.0 + e) * force / arrival, -e]])
            matrix = saltation @ np.array([[1.0, dt], [0.0, 1.0]]) @ matrix
        assert np.trace(matrix) == pytest.approx(sizes[number], rel=1e-5)
    assert branch.values[-1] == pytest.approx(1.18 * case.doubling * weight)


@pytest.mark.parametrize(
    ("omega", "stop", "restitution"), [(3.2, 0.1, 0.5), (3.2, 0.1, 0.8), (2.6, 0.1, 0.8), (1.7, -0.1, 0.5)]
)
def test_linear_impact_oscillator_folds(omega: float, stop: float, restitution: float) -> None:
    case = LinearImpacts(omega, stop, restitution)
    (_, angle), *_ = case.roots(1.0000001 * case.fold)
    phase = (0.5 * angle / math.pi + 0.5) % 1.0
    branch = impacts(case, 1.05 * case.fold, 0, phase, (0.5 * case.fold, 1.1 * case.fold))
    assert values(branch, "fold") == [pytest.approx(case.fold, rel=SHARP)]
    for value, x, v, multipliers in zip(branch.values, branch.x, branch.v, branch.multipliers, strict=True):
        exact = []
        for b, place in case.roots(value):
            late = ((2.0 * math.pi * phase - place) / omega) % case.period
            exact.append((*case.state(value, b, place, late), case.trace(b)))
        nearest = min(exact, key=lambda found: abs(found[0] - x[0]), default=None)
        if nearest is None or value < 1.0001 * case.fold:
            continue
        np.testing.assert_allclose((x[0], v[0]), nearest[:2], atol=1e-8)
        assert multipliers.sum().real == pytest.approx(nearest[2], abs=1e-5)
        assert multipliers.prod().real == pytest.approx(restitution**2, rel=1e-7)


@pytest.mark.parametrize(
    ("omega", "stop", "restitution"), [(3.2, 0.1, 0.5), (3.2, 0.1, 0.8), (2.2, -0.1, 0.8), (0.8, -0.1, 0.5)]
)
def test_linear_impact_oscillator_doubles(omega: float, stop: float, restitution: float) -> None:
    case = LinearImpacts(omega, stop, restitution)
    force, b = case.doubling
    which = int(np.argmin([abs(root[0] - b) for root in case.roots(force)]))
    assert case.trace(b) == pytest.approx(-1.0 - restitution**2, rel=1e-12)
    phase = (0.5 * case.roots(force)[which][1] / math.pi + 0.5) % 1.0
    branch = impacts(case, 1.02 * force, which, phase, (0.95 * force, 1.05 * force))
    assert values(branch, "period doubling") == [pytest.approx(force, rel=SHARP)]


def test_an_oscillation_ends_where_it_grazes_a_rigid_stop() -> None:
    case = LinearImpacts(1.7, -0.1, 0.8)
    force = 0.5 * case.grazing
    branch = continuation(
        oscillator_of(case),
        "drive.amplitude",
        (0.1 * case.grazing, 2.0 * case.grazing),
        drive=ph.SineForce(force, case.omega / (2.0 * math.pi), phase=0.5 * math.pi),
        state=(0.0, -case.gain(force) * case.omega),
        phase=0.25,
    )
    assert [stop.reason for stop in branch.stops] == ["bound", "grazing"]
    assert branch.stops[1].parameter == pytest.approx(case.grazing, rel=1e-10)
    assert "grazes" in branch.message
    speeds = [-case.gain(value) * case.omega for value in branch.values]
    np.testing.assert_allclose(branch.v[:, 0], speeds, atol=1e-9)


def test_a_branch_goes_on_where_its_impact_meets_the_section() -> None:
    case = LinearImpacts(1.7, -0.1, 0.8)
    force = 0.756
    (b, angle), _ = case.roots(force)
    phase = (0.5 * angle / math.pi + 0.45) % 1.0
    late = (2.0 * math.pi * phase - angle) / case.omega % case.period
    branch = continuation(
        oscillator_of(case),
        "drive.amplitude",
        (0.1 * case.grazing, 1.05 * force),
        drive=ph.SineForce(force, case.omega / (2.0 * math.pi), phase=0.5 * math.pi),
        state=case.state(force, b, angle, late),
        phase=phase,
    )
    # Beyond the fold to where the speed of the impact vanishes.
    assert [stop.reason for stop in branch.stops] == ["grazing", "bound"]
    assert branch.stops[0].parameter == pytest.approx(case.grazing, rel=1e-10)
    assert [event.kind for event in branch.events] == ["section", "fold"]
    moved, fold = branch.events
    assert "nears the section, which moves to the phase" in moved.message
    assert fold.value == pytest.approx(case.fold, rel=SHARP)
    # In order along the branch it moves to where the branch began.
    assert moved.phase == phase
    assert len(set(branch.phases)) == 2
    for value, x, v, at in zip(branch.values, branch.x, branch.v, branch.phases, strict=True):
        exact = [
            case.state(value, b, angle, ((2.0 * math.pi * at - angle) / case.omega) % case.period)
            for b, angle in case.roots(value)
        ]
        if value > 1.0001 * case.fold:
            assert min(math.dist((x[0], v[0]), state) for state in exact) < 1e-7


@pytest.mark.parametrize("phase", [0.25, 0.75])
def test_a_branch_goes_to_the_grazing_in_which_its_impact_fades(phase: float) -> None:
    # x'' + 0.1 x' + x = F cos(w t) with impacts at x = -0.1; a free oscillation is F / |1 - w^2 + 0.1 i w|.
    omega, damping, stop = 2.0 * math.pi * 0.5, 0.1, 0.1
    square = 1.0 - 0.5 * damping**2
    grazing = math.sqrt(square + math.sqrt(square**2 - 1.0 + 1.0 / stop**2)) / (2.0 * math.pi)
    case = DampedImpacts(omega, -stop, 0.8, damping)
    low, high = 0.0, 0.5
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if case.orbit(middle)[0] < 1.0 else (low, middle)
    _, angle, _ = case.orbit(low)
    assert case.possible(low)
    late = ((2.0 * math.pi * phase - angle) / omega) % case.period
    branch = continuation(
        ph.load("shaw-holmes-1983"),
        "rate",
        (0.37, 0.541),
        drive=ph.SineForce(1.0, 0.5, phase=0.5 * math.pi),
        state=case.state(low, late),
        phase=phase,
    )
    assert [stop.reason for stop in branch.stops] == ["bound", "grazing"]
    assert branch.stops[1].parameter == pytest.approx(grazing, rel=1e-9)
    assert grazing - branch.values[-1] < 5e-4 * grazing
    # e^2 exp(-c T), at any speed of the impact.
    np.testing.assert_allclose(
        np.prod(branch.multipliers, axis=1).real, 0.64 * np.exp(-0.1 / branch.values), rtol=1e-3
    )
    assert [event.kind for event in branch.events] == ["period doubling"]
    assert len(branch) < 350


def test_a_stable_range_ends_at_the_grazing_and_not_at_the_last_orbit() -> None:
    # F / |1 - w^2 + 0.1 i w| = 0.1, at w = 2.
    grazing = 0.1 * math.hypot(1.0 - 4.0, 0.2)
    force = 0.9 * grazing
    gain = force / complex(1.0 - 4.0, 0.2)
    branch = continuation(
        ph.load("shaw-holmes-1983"),
        "drive.amplitude",
        (0.5 * grazing, 1.2 * grazing),
        drive=ph.SineForce(force, 1.0 / math.pi, phase=0.5 * math.pi),
        state=(gain.real, (2j * gain).real),
    )
    assert branch.stops[1].reason == "grazing"
    assert branch.stable_ranges == [pytest.approx((0.5 * grazing, grazing), rel=1e-10)]


HOPPER = BouncingBall(1.5, 0.4, 3.0)
AT_IMPACT = math.acos(HOPPER.fold * 3.0 / 5.3)


@pytest.mark.parametrize(
    ("force_phase", "section"),
    # The impact at the fold lies on the section; that at the start does; neither does.
    [(0.0, 0.0), (AT_IMPACT, 0.0), (0.0, AT_IMPACT / (2.0 * math.pi)), (0.5, 0.4)],
)
def test_no_section_hides_a_fold(force_phase: float, section: float) -> None:
    weight, amplitude, omega, start = 3.0, 5.3, 6.0 * math.pi, AT_IMPACT
    hammer = ph.Hammer.build(
        2.0,
        spring={"law": "preload", "preload": -weight, "stiffness": 0.0},
        backstop={"law": "rigid", "position": 0.0, "restitution": 0.4},
    )
    # Flight from the impact at the angle `start` of the force to the section.
    late = ((2.0 * math.pi * section + force_phase - start) % (2.0 * math.pi)) / omega
    push, up, now = amplitude / 2.0, 0.5 * 0.4 / 1.4, start + omega * late
    v = up - 1.5 * late - push / omega * (math.cos(now) - math.cos(start))
    x = (up + push / omega * math.cos(start)) * late - 0.75 * late**2
    x -= push / omega**2 * (math.sin(now) - math.sin(start))
    branch = continuation(
        hammer,
        "drive.amplitude",
        (3.9, 6.0),
        drive=ph.SineForce(amplitude, 3.0, phase=force_phase),
        state=(x, v),
        phase=section,
    )
    assert [(stop.reason, stop.parameter) for stop in branch.stops] == [("bound", 6.0), ("bound", 6.0)]
    # W pi (1-e)/(1+e), and W sqrt((pi (1-e)/(1+e))^2 + (2 (1+e^2)/(1+e)^2)^2).
    assert values(branch, "fold") == [pytest.approx(4.0391905546, rel=1e-10)]
    assert values(branch, "period doubling") == [pytest.approx(5.3781787136, rel=1e-10)]
    (limits,) = branch.stable_ranges
    assert limits == pytest.approx((4.0391905546, 5.3781787136), rel=1e-10)
    (fold,) = [event for event in branch.events if event.kind == "fold"]
    np.testing.assert_allclose(fold.multipliers.real, [1.0, 0.16], atol=1e-6)


def test_an_oscillation_goes_on_where_it_grazes_a_pack() -> None:
    # x'' + x = F cos(w t) is F / (1 - w^2) cos(w t), and meets the pack where that gets to its front.
    omega, front = 1.7, 0.1
    limit = front * (omega**2 - 1.0)
    hammer = ph.Hammer.build(
        1.0,
        spring={"law": "preload", "preload": 0.2, "stiffness": 1.0},
        pack={"law": "power", "front": front, "thickness": 0.05, "stiffness": 50.0},
        # Out of reach; the machine code for these laws is that of other tests.
        backstop={"law": "hertz", "position": -0.2, "stiffness": 1.0, "damping": 0.0},
    )
    force = 0.95 * limit
    branch = continuation(
        hammer,
        "drive.amplitude",
        (0.9 * limit, 1.1 * limit),
        drive=ph.SineForce(force, omega / (2.0 * math.pi), phase=0.5 * math.pi),
        state=(force / (1.0 - omega**2), 0.0),
        most=60,
    )
    (event,) = [event for event in branch.events if event.kind == "grazing"]
    assert event.value == pytest.approx(limit, rel=1e-6)
    assert (event.surface, event.change, event.contacts) == ("pack", "appears", ("", "P"))
    assert branch.values.max() > 1.0001 * limit
    assert set(branch.contacts) == {"", "P"}
    np.testing.assert_array_equal(branch.pack_contacts, [int(word == "P") for word in branch.contacts])
    # Without contact areas are preserved, and both multipliers stay on the unit circle: no event.
    assert [event.kind for event in branch.events if event.contacts == ("", "")] == []


@pytest.mark.slow
def test_a_chart_has_a_limit_that_its_branch_does_not_meet() -> None:
    # At e = 0.8 the doubling lies at 1.0708, above the range; at e = 0.9 at 1.0163, within it.
    case = BouncingBall(GRAVITY, 0.8, FREQUENCY)
    branch = bounces(case, 0.8, (0.3, 1.05))
    assert [event.kind for event in branch.events] == ["fold"]
    chart = stability_chart(branch, "backstop.restitution", (0.7, 0.9), grid=(0, 0))
    assert sorted(curve.kind for curve in chart.curves) == ["fold", "period doubling"]
    (doubling,) = [curve for curve in chart.curves if curve.kind == "period doubling"]
    exact = [BouncingBall(GRAVITY, e, FREQUENCY).doubling for e in doubling.second]
    np.testing.assert_allclose(doubling.first / (MASS * GRAVITY), exact, rtol=1e-6)
    assert doubling.second.max() == pytest.approx(0.9)
    assert "other limits are not in the chart" in chart.message
