"""Tests of each conclusion against its definition, with single runs."""

import math
from collections.abc import Iterator

import numpy as np
import pytest
from studies.reconstruction.family import conclusions
from studies.reconstruction.family.conclusions import QUANTITIES, Conclusions, conclude

import printhammer as ph
from printhammer.claims import Context
from printhammer.claims.context import NotMeasurableError


@pytest.fixture(scope="module")
def context(hammer: ph.Hammer) -> Context:
    return Context(hammer)


@pytest.fixture(scope="module")
def found(hammer: ph.Hammer, context: Context) -> Conclusions:
    return conclude(hammer, context)


def test_every_conclusion_is_described_with_its_unit() -> None:
    assert list(QUANTITIES) == list(Conclusions.__dataclass_fields__)
    for name, quantity in QUANTITIES.items():
        assert name.endswith(f"_{quantity.unit}")


def bad_patterns(hammer: ph.Hammer, rate: float) -> Iterator[tuple[int, ...]]:
    """Yield the badly printed patterns of eight slots at a rate, found by single runs."""
    single = ph.simulate(hammer, ph.PulseTrain(hammer.waveform), duration=20e-3).dots[0]
    for number in range(1, 256):
        slots = tuple(slot for slot in range(8) if number >> slot & 1)
        if slots[0] != 0:
            continue
        drive = ph.PulseTrain(hammer.waveform, at=[slot / rate for slot in slots])
        dots = ph.simulate(hammer, drive, duration=slots[-1] / rate + 4e-3, points=2).dots
        good = all(
            dot.struck
            and dot.extra_contacts == 0
            and abs(dot.peak_force / single.peak_force - 1.0) <= 0.1
            and abs(dot.flight_time - single.flight_time) <= 50e-6
            for dot in dots
        )
        if not good or len(dots) != len(slots):
            yield slots


@pytest.mark.slow
def test_at_the_safe_rate_all_patterns_are_printed_well_and_at_the_next_one_not(
    hammer: ph.Hammer, found: Conclusions
) -> None:
    rate = found.safe_rate_Hz
    assert rate is not None
    assert rate % 5.0 == 0.0
    assert list(bad_patterns(hammer, rate)) == []
    assert any(bad_patterns(hammer, rate + 5.0))


def test_without_a_rate_at_which_patterns_are_printed_well_there_is_no_safe_rate(
    context: Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(conclusions, "GRID", (1900, 2000, 50))
    assert conclusions.rate_from_rest(context) is None


@pytest.mark.slow
def test_chaos_begins_there_and_not_before(hammer: ph.Hammer, found: Conclusions) -> None:
    onset = found.chaos_onset_s
    assert onset is not None
    assert ph.strobe(hammer, period=onset, points=1).verdict.strange
    for step in range(1, 6):
        assert not ph.strobe(hammer, period=onset + 5e-6 * step, points=1).verdict.strange


def test_no_chaos_is_none(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(conclusions, "ONSET_STEP", 2.2e-3 / 2)
    monkeypatch.setattr(conclusions, "scan", lambda *_, **__: [_Calm(), _Calm(), _Calm()])
    assert conclusions.chaos_onset(context) is None


class _Calm:
    strange = False


def test_flight_times_are_those_of_bursts_run_alone(hammer: ph.Hammer, context: Context) -> None:
    largest, limits = conclusions.flight_times(context)
    for limit, rate in {30e-6: limits["engraved_s"], 200e-6: limits["dot_matrix_s"]}.items():
        assert rate is not None
        for some, over in ((rate, True), (rate - 5.0, False)):
            drive = ph.PulseTrain(hammer.waveform, rate=some, pulses=9)
            dots = ph.simulate(hammer, drive, duration=8.0 / some + 4e-3, points=2).dots
            flights = [dot.flight_time for dot in dots if dot.flight_time is not None]
            assert (np.ptp(flights) > limit) == over
    assert largest > 200e-6


@pytest.mark.slow
def test_from_rest_to_rest_the_coil_gives_what_pack_and_backstop_take(found: Conclusions) -> None:
    taken = found.pack_loss_J + found.backstop_loss_J
    assert math.isclose(found.energy_per_dot_J, taken, rel_tol=1e-6)
    assert min(found.pack_loss_J, found.backstop_loss_J) > 0.0


def test_after_settle_out_no_rebound_is_higher_than_a_hundredth_of_the_stroke(
    hammer: ph.Hammer, context: Context
) -> None:
    settled = conclusions.settle_out(context)
    motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform), duration=20e-3)
    times, x = motion.maxima
    heights = (x - hammer.position) / (x.max() - hammer.position)
    assert heights[times > settled].max() <= 0.01
    last = np.flatnonzero(times < settled)[-1]
    assert heights[last] > 0.01
    assert motion.at([settled])[0][0] == pytest.approx(hammer.position, abs=1e-12)


def test_a_pulse_that_does_not_print_is_told(hammer: ph.Hammer) -> None:
    weak = hammer.replace("waveform.amplitude", "0.01 A")
    with pytest.raises(NotMeasurableError):
        conclude(weak)
