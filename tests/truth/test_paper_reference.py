"""Figures 7 and 11 of the shipped hammer by the reference integrator."""

import numpy as np
import pytest
from tests.oracle.integrator import ReferenceRun, reference

import printhammer as ph
from printhammer.printing.dots.buzz import BuzzTrain, find_buzz_train

INCH = 0.0254


def shipped() -> ph.Hammer:
    return ph.load("hendriks-1983")


def dots_of(hammer: ph.Hammer, run: ReferenceRun) -> list[tuple[float, float, float]]:
    """Return the start [s], end [s] and peak force [N] of each pack contact, by equation (5)."""
    pack = {key: hammer.constants[f"pack.{key}"].si for key in ("stiffness", "thickness", "front")}
    dots, touch, deepest = [], 0.0, 0.0
    for event in run.events:
        if event.kind == "pack-touch":
            touch, deepest = event.time, 0.0
        elif event.kind == "pack-peak":
            deepest = max(deepest, event.x - pack["front"])
        elif event.kind == "pack-leave":
            dots.append((touch, event.time, pack["stiffness"] * (deepest / pack["thickness"]) ** 2.7))
    return dots


def fired(hammer: ph.Hammer, times: tuple[float, ...]) -> ReferenceRun:
    return reference(hammer, ph.PulseTrain(hammer.waveform, at=list(times)), times[-1] + 1.5e-3)


@pytest.mark.slow
def test_the_train_of_figure_7_prints_clear_of_the_backstop() -> None:
    hammer = shipped()
    train = find_buzz_train(hammer).train
    assert isinstance(train, BuzzTrain)
    ((_touch, _leaving, single),) = dots_of(hammer, fired(hammer, (0.0,)))[:1]
    run = fired(hammer, train.times)
    dots = dots_of(hammer, run)
    assert len(dots) == len(train.times)
    counted = dots[train.first : train.first + train.count]
    assert len(counted) >= 6
    relative = [force / single for *_, force in counted]
    assert min(relative) >= 0.3
    assert max(relative) <= 0.95
    np.testing.assert_allclose(relative, train.forces, rtol=1e-6)
    touches = [event.time for event in run.events if event.kind == "backstop-touch"]
    first, last = counted[0][0], counted[-1][0]
    before, between = sum(t < first for t in touches), sum(first <= t <= last for t in touches)
    assert between == 0
    assert (before, between) == train.touches[:2]
    # Each pulse follows the leaving of the pack by the same delay.
    delays = np.array(train.times[1:]) - [leaving for _touch, leaving, _force in dots[:-1]]
    np.testing.assert_allclose(delays, train.interval, rtol=0.0, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("milliseconds", "period"), [(1.35, 2), (1.0, 1)])
def test_a_panel_of_figure_11_has_the_period_of_the_verdict(milliseconds: float, period: int) -> None:
    hammer, time, firings = shipped(), milliseconds * 1e-3, 120
    strobe = ph.strobe(hammer, period=time, points=1)
    assert strobe.verdict is not None
    assert strobe.verdict.name == f"period-{period}"
    drive = ph.PulseTrain(hammer.waveform, period=time, pulses=firings + 1)
    run = reference(hammer, drive, firings * time, times=np.arange(firings + 1) * time * (1.0 - 1e-15))
    assert run.status == "ok"
    # In half-widths of the window of the paper, 0.0015 to 0.0035 in and 25 in/s either way.
    states = np.column_stack([run.x / (0.001 * INCH), run.v / (25.0 * INCH)])[-24:]
    for q in range(1, period + 1):
        apart = np.abs(states[q:] - states[:-q]).max()
        assert (apart < 1e-6) == (q == period)
