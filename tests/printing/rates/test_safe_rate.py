import itertools
import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused
from tests.hammers import made_of, preload

import printhammer as ph
from printhammer.drive.trains import Drive
from printhammer.printing.dots.judging import Limits
from printhammer.printing.dots.nominal import nominal, single_pulses
from printhammer.printing.dots.strategy import FIRST_SLOT, open_loop
from printhammer.printing.dots.trial import Case, attempt
from printhammer.printing.rates.safe_rate import from_rest, rate_grid, safe_rate
from printhammer.printing.rates.variability import Perturbation, perturbed
from printhammer.printing.rates.words import words_of

COARSE = {"first": 250.0, "step": 125.0, "last": 2000.0}


def printed_well(hammer: "ph.Hammer", rate: float, limits: Limits) -> bool:
    """Whether all patterns from rest are within limits, simulated one by one without ensembles."""
    single = ph.simulate(hammer, ph.PulseTrain(hammer.waveform), duration=4e-3).dots[0]
    for row in itertools.product((False, True), repeat=8):
        slots = [slot for slot, wanted in enumerate(row) if wanted]
        if not slots or slots[0]:
            continue
        train = ph.PulseTrain(hammer.waveform, at=[slot / rate for slot in slots])
        for slot, dot in zip(slots, ph.simulate(hammer, train, points=2).dots, strict=True):
            if not dot.struck or dot.extra_contacts > limits.extra_contacts:
                return False
            if abs(dot.peak_force / single.peak_force - 1.0) > limits.force:
                return False
            late = dot.fired_at + dot.flight_time - slot / rate - single.flight_time
            if abs(late) > limits.arrival:
                return False
    return True


@pytest.mark.slow
def test_patterns_from_rest_against_one_motion_after_the_other(hammer: "ph.Hammer") -> None:
    limits = Limits(force=0.3, arrival=100e-6)
    found = safe_rate(hammer, limits=limits, **COARSE)
    assert math.isfinite(found.rate)
    assert all(printed_well(hammer, rate, limits) for rate in found.rates[found.passed][-2:])
    bad = found.rates[~found.passed]
    assert bad.tolist() == [found.rate + 125.0]
    if found.failure.kind == "from rest":
        assert not printed_well(hammer, float(bad[0]), limits)


def test_what_fails_first_fails_alone_as_well(hammer: "ph.Hammer") -> None:
    found = safe_rate(hammer, **COARSE)
    failure = found.failure
    assert failure is not None
    assert failure.kind == "from rest"
    slots = [slot for slot, letter in enumerate(failure.pattern) if letter == "1"]
    assert slots[-1] == failure.slot == len(failure.pattern) - 1
    train = ph.PulseTrain(hammer.waveform, at=[slot / failure.rate for slot in slots])
    dot = ph.simulate(hammer, train, points=2).dots[-1]
    single = nominal(hammer)
    if failure.fault == "lost":
        assert not dot.struck
    elif failure.fault == "force":
        assert dot.peak_force / single.force - 1.0 == pytest.approx(failure.deviation, abs=1e-6)
        assert abs(failure.deviation) > found.limits.force
    elif failure.fault == "arrival":
        assert dot.flight_time - single.flight_time == pytest.approx(failure.deviation, abs=1e-10)
        assert abs(failure.deviation) > found.limits.arrival
    else:
        assert dot.extra_contacts == failure.deviation > 0
    assert failure.text.endswith(".")


def test_a_rate_that_eight_dots_bear_and_a_row_does_not_is_not_safe() -> None:
    """At 840 Hz an error of a row alternates in sign and grows from dot to dot, as one long motion shows."""
    hammer = ph.load("hendriks-1983-1")
    grid = {"first": 835.0, "last": 840.0}
    assert safe_rate(hammer, long=False, **grid).at_least
    found = safe_rate(hammer, **grid)
    assert found.rate == 835.0
    assert (found.multiplier < -1.0).all()
    failure = found.failure
    assert failure is not None
    assert (failure.kind, failure.rate) == ("row", 840.0)
    assert 8 < failure.dot == failure.slot + 1
    row = ph.PulseTrain(hammer.waveform, rate=840.0, pulses=failure.dot)
    forces = [dot.peak_force or 0.0 for dot in ph.simulate(hammer, row, points=2).dots]
    off = np.array(forces) / found.nominal.force - 1.0
    assert off[-1] == pytest.approx(failure.deviation, abs=1e-6)
    assert np.abs(off[:-1]).max() <= found.limits.force < abs(off[-1])


def test_slow_enough_everything_passes(hammer: "ph.Hammer") -> None:
    found = safe_rate(hammer, first=70.0, last=80.0, step=10.0)
    assert found.passed.tolist() == [True] * 2
    assert found.long_run.all()
    assert found.at_least
    assert found.rate == 80.0
    assert max(np.abs(found.force_low).max(), np.abs(found.force_high).max()) < 1e-6
    assert found.peak_drive == pytest.approx(hammer.waveform.peak)


def test_limits_that_nothing_keeps_leave_no_rate(hammer: "ph.Hammer") -> None:
    found = safe_rate(hammer, limits=Limits(arrival=0.0), first=900.0, last=950.0)
    assert math.isnan(found.rate)
    assert math.isnan(found.peak_drive)
    assert not found.passed.any()


def test_patterns_that_begin_later_are_printed_alike(hammer: "ph.Hammer") -> None:
    found = safe_rate(hammer, first=600.0, last=1500.0, step=50.0, long=False)
    assert not found.long_run.any()
    assert not found.at_least
    cases = [Case(hammer, found.nominal, rate) for rate in (found.rate, found.rate + 50.0)]
    for every, count in ((False, 128), (True, 255)):
        patterns = from_rest(every=every)
        assert len(patterns) == count
        trial = attempt(cases, patterns, limits=found.limits, tolerance=found.tolerance)
        assert trial.passed.tolist() == [True, False]


def test_rates_beyond_the_first_failure_are_run_on_request(hammer: "ph.Hammer") -> None:
    coarser = {"first": 500.0, "step": 250.0, "last": 1500.0}
    short = safe_rate(hammer, **coarser)
    long = safe_rate(hammer, stop=False, **coarser)
    assert long.rate == short.rate
    assert long.failure == short.failure
    assert long.rates[-1] == 1500.0
    assert len(short.rates) < len(long.rates)
    np.testing.assert_array_equal(long.force_high[: len(short.rates)], short.force_high)


def test_a_strategy_may_fire_ahead(hammer: "ph.Hammer") -> None:
    """Dots that are all equally early are judged relative to their slots, not to their firings."""

    def ahead(driven: "ph.Hammer", patterns: Sequence[tuple[int, ...]], rate: float) -> list[Drive]:
        return [drive.with_times(drive.times - 40e-6) for drive in open_loop(driven, patterns, rate)]

    found = safe_rate(hammer, ahead, first=80.0, last=80.0)
    assert found.strategy == "ahead"
    assert found.arrival_low[0] == pytest.approx(-40e-6, abs=1e-9)
    assert found.arrival_high[0] == pytest.approx(-40e-6, abs=1e-9)
    assert safe_rate(hammer, ahead, limits=Limits(arrival=39e-6), first=80.0, last=80.0).failure is not None


def test_a_strategy_whose_drives_do_not_fit_is_refused(hammer: "ph.Hammer") -> None:
    one = ph.PulseTrain(hammer.waveform, start=FIRST_SLOT)
    with refused("strategy"):
        safe_rate(hammer, lambda *_: [one], first=100.0, last=100.0)
    with refused("strategy"):
        safe_rate(hammer, lambda _h, patterns, _r: [one] * len(patterns), first=100.0, last=100.0)


def test_the_result_does_not_depend_on_threads(hammer: "ph.Hammer") -> None:
    few = {"first": 700.0, "last": 800.0, "step": 100.0, "stop": False}
    one, other = (safe_rate(hammer, threads=threads, **few) for threads in (1, 2))
    for name in ("force_low", "force_high", "arrival_low", "arrival_high", "passed"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_more_current_is_a_stronger_coil(hammer: "ph.Hammer") -> None:
    more = perturbed(hammer, Perturbation(current=0.05))
    drive = ph.PulseTrain(hammer.waveform)
    ours = ph.simulate(more, drive, duration=4e-3).dots[0]
    theirs = ph.simulate(hammer, drive.scaled(1.05), duration=4e-3).dots[0]
    assert ours.flight_time == pytest.approx(theirs.flight_time, rel=1e-9)
    assert ours.peak_force == pytest.approx(theirs.peak_force, rel=1e-8)


def test_other_perturbations_change_what_they_name(hammer: "ph.Hammer") -> None:
    travel = perturbed(hammer, Perturbation(travel=10e-6))
    assert travel.front - hammer.front == pytest.approx(10e-6, rel=1e-9)
    assert travel.platen - hammer.platen == pytest.approx(10e-6, rel=1e-9)
    forms = perturbed(hammer, Perturbation(forms=0.1))
    assert forms.platen == hammer.platen
    assert forms.front + forms.pack.thickness == pytest.approx(
        hammer.front + hammer.pack.thickness, rel=1e-12
    )
    assert perturbed(hammer, Perturbation()) == hammer
    assert Perturbation(current=0.03, travel=-1e-5).name == "current +3 %, travel -10 µm"
    assert perturbed(hammer, Perturbation(damping=-0.2)).backstop.l == pytest.approx(0.8 * hammer.backstop.l)
    assert perturbed(hammer, Perturbation(magnet=0.01)).magnet.Am == pytest.approx(1.01 * hammer.magnet.Am)


def test_single_pulses_are_those_of_single_motions(hammer: "ph.Hammer") -> None:
    weak = hammer.replace("waveform.amplitude", 1e-3)
    found = single_pulses([hammer, weak])
    assert found[1] is None
    single = nominal(hammer)
    assert found[0].force == pytest.approx(single.force, rel=1e-8)
    assert found[0].flight_time == pytest.approx(single.flight_time, rel=1e-9)
    with refused("pulse"):
        nominal(weak)


def test_the_grid_ends_where_it_is_told() -> None:
    np.testing.assert_allclose(rate_grid(100, 101, 0.1), 100.0 + 0.1 * np.arange(11), rtol=1e-14)
    assert rate_grid("0.1 kHz", "0.11 kHz", 4).tolist() == [100.0, 104.0, 108.0]


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({"first": 0.0}, "first"),
        ({"last": 50.0}, "last"),
        ({"step": "1 ms"}, "step"),
        ({"step": 1e-3}, "rates"),
    ],
)
def test_bad_grids_are_refused(hammer: "ph.Hammer", options: dict[str, object], key: str) -> None:
    with refused(key):
        safe_rate(hammer, **options)


@pytest.mark.parametrize(
    ("by", "key"),
    [
        (Perturbation(current=-1.0), "current"),
        (Perturbation(travel=math.inf), "travel"),
        (Perturbation(current=0.1), "magnet"),
        (Perturbation(travel=1e-6), "travel"),
        (Perturbation(damping=0.1), "damping"),
    ],
)
def test_perturbations_that_make_no_sense_are_refused(by: Perturbation, key: str) -> None:
    with refused(key):
        perturbed(made_of(spring=preload(-1.0)), by)


def test_drives_may_fire_waveforms_of_their_own(hammer: "ph.Hammer") -> None:
    """The same pulses as a sequence, which uses another path of the kernel, give the same result."""

    def sequence(driven: "ph.Hammer", patterns: Sequence[tuple[int, ...]], rate: float) -> list[Drive]:
        drives = open_loop(driven, patterns, rate)
        return [ph.PulseSequence([driven.waveform] * len(drive.times), at=drive.times) for drive in drives]

    few = {"first": 800.0, "last": 800.0, "tolerance": 1e-8}
    ours, theirs = safe_rate(hammer, sequence, **few), safe_rate(hammer, **few)
    assert ours.long_run.tolist() == theirs.long_run.tolist()
    np.testing.assert_allclose(ours.force_high, theirs.force_high, atol=1e-4)
    np.testing.assert_allclose(ours.arrival_low, theirs.arrival_low, atol=1e-8)
    assert ours.failure == theirs.failure or (ours.failure.slot, ours.failure.fault) == (
        theirs.failure.slot,
        theirs.failure.fault,
    )


@pytest.mark.slow
def test_words_give_the_rate_and_the_deviations_of_all_patterns(monkeypatch: pytest.MonkeyPatch) -> None:
    """A relay comes to rest between dots two slots apart; the patterns themselves are simulated as well."""
    hammer = ph.load("relay-5v")
    brief = safe_rate(hammer, first=29.8)
    assert len(brief.rates) > 1
    monkeypatch.setattr("printhammer.printing.rates.safe_rate.attempt_words", lambda *_, **__: None)
    whole = safe_rate(hammer, first=29.8)
    assert (brief.rate, brief.failure) == (whole.rate, whole.failure)
    assert (brief.passed == whole.passed).all()
    assert (brief.long_run == whole.long_run).all()
    for side in ("force_low", "force_high", "arrival_low", "arrival_high"):
        np.testing.assert_allclose(getattr(brief, side), getattr(whole, side), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("multiplier", [-1.19, 1.19, np.nan])
def test_rows_in_which_errors_grow_are_run_to_their_end(
    monkeypatch: pytest.MonkeyPatch, multiplier: float
) -> None:
    """The dots of such a row may agree to 1e-6 at the 24th dot and be lost at the 100th dot."""
    run_whole: list[float] = []

    class EnoughError(Exception):
        """End the search at the first rate whose patterns are simulated themselves."""

    def whole(cases: Sequence[Case], *_: object, **__: object) -> None:
        run_whole.append(cases[0].rate)
        raise EnoughError

    monkeypatch.setattr("printhammer.printing.rates.safe_rate.attempt_patterns", whole)
    monkeypatch.setattr(
        "printhammer.printing.rates.words.multipliers",
        lambda _hammers, rates, *_: np.where(np.asarray(rates) > 30.05, multiplier, 0.5),
    )
    with pytest.raises(EnoughError):
        safe_rate(ph.load("relay-5v"), first=30.0)
    assert run_whole == [pytest.approx(30.1)]


@given(st.sets(st.integers(0, 40), min_size=1), st.integers(1, 4))
def test_every_dot_of_a_pattern_has_its_history_in_a_word(chosen: set[int], gap: int) -> None:
    slots = sorted(chosen)
    words = words_of([slots], gap)
    for number, slot in enumerate(slots):
        begin = number
        while begin and slots[begin] - slots[begin - 1] < gap:
            begin -= 1
        history = tuple(each - slots[begin] for each in slots[begin : number + 1])
        assert any(word[: len(history)] == history for word in words)
        assert slot - slots[begin] == history[-1]
    assert all(word[0] == 0 for word in words)
