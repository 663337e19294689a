"""Readout of runs: curves, contacts and dots, codes of maps, printed lines, strobe sections."""

import dataclasses
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import printhammer as ph
from printhammer.chaos.orbits import newton as library
from printhammer.chaos.orbits import settled
from printhammer.chaos.orbits.newton import CLOSED, Images
from printhammer.chaos.orbits.settled import _by_states, shown
from printhammer.chaos.strobe.map import IN_PACK, STILL_COIL
from printhammer.chaos.strobe.train import pack_branches
from printhammer.chaos.strobe.verdict import (
    AGREEMENT,
    LARGEST_PERIOD,
    SIGNIFICANT,
    period_of,
    repeats,
    verdict,
)
from printhammer.derivatives.states import Exponent, standard_error
from printhammer.drive.batch import PulseTrains, Ragged
from printhammer.drive.waveforms.shapes import Rectangle
from printhammer.kernel.model.modes import BACKSTOP_SURFACE, LOADING, PACK_SURFACE, UNLOADING
from printhammer.kernel.readout import codes, contacts, curves, energy, line, newton, section
from printhammer.printing.dots.judging import PRESETS
from printhammer.printing.dots.strategy import FIRST_SLOT, slot_times
from printhammer.printing.page.page import head_of, print_page
from printhammer.printing.page.pattern import Pattern
from printhammer.run.energy import Ledger
from printhammer.run.ensemble import DISPLAY_TOLERANCE, Ensemble
from printhammer.run.ensemble_group import Job
from printhammer.run.window import wait_of

FEWEST = 200


@given(st.lists(st.just(0.0) | st.floats(1e-9, 1e-3), min_size=1, max_size=60).filter(any))
def test_a_curve_passes_every_step_and_has_no_wide_gap(steps: list[float]) -> None:
    nodes = np.concatenate([[0.0], np.cumsum(steps)])[:, np.newaxis]
    times = np.empty(FEWEST + 3 * len(nodes) + 1)
    times = times[: curves.write_times(nodes, FEWEST, 1000, times)]
    assert np.isin(nodes, times).all()
    assert (np.diff(times) >= 0.0).all()
    assert np.diff(times).max() <= 1.000001 * nodes[-1, 0] / FEWEST


def test_curves_are_the_columns_of_the_run_and_their_sum() -> None:
    table = np.random.default_rng(0).normal(size=(7, 10))
    out, largest = np.empty((curves.CURVES, 7), np.float32), np.empty(1)
    curves.write_curves(table, True, out, largest)
    assert largest[0] == np.abs(table[:, 2]).max()
    np.testing.assert_allclose(out[curves.TOTAL], table[:, 2:9].sum(axis=1), rtol=1e-5, atol=1e-6)
    np.testing.assert_array_equal(out[[0, 1, 2, 3]], np.float32([*table[:, :3].T, np.zeros(7)]))


def test_contacts_are_numbered_from_each_firing() -> None:
    pack, stop = float(PACK_SURFACE), float(BACKSTOP_SURFACE)
    record = np.array(
        [
            [pack, 0.0, 0.0, 0.5, -1.0, 0, 1],
            [stop, 0.6, -1.0, 0.7, 1.0, 1, 0],
            [pack, 1.0, 1.0, 1.5, -0.5, 2, 0],
            [pack, 1.7, 0.4, 1.8, -0.2, 3, 0],
            [pack, 2.5, 1.0, math.nan, math.nan, 4, 0],
        ]
    )
    nodes = np.column_stack([[0.0, 0.6, 1.0, 1.7, 2.5, 3.0]])
    losses = np.arange(25.0).reshape(5, 5)
    firings = np.array([0.9, 2.0, 2.9, 5.0])
    rows = np.empty((5, contacts.CONTACT_WIDTH))
    peaks = record[:, [1, 2, 2]]
    contacts.write_contacts(record, nodes, peaks, losses, firings, True, np.empty(128), rows)
    assert rows[:, contacts.NUMBER].tolist() == [-1, -1, 0, 1, 0]
    assert rows[:, contacts.FIRING].tolist() == [-1, -1, 0, 0, 1]
    assert np.isnan(rows[:, contacts.FORCE]).tolist() == [False, True, False, False, False]
    dots = np.empty((4, contacts.DOT_WIDTH))
    assert contacts.write_dots(firings, 3.0, rows, np.ones(5), np.ones((5, 3)), dots) == 3
    assert dots[:3, contacts.STRUCK].tolist() == [1.0, 1.0, 0.0]
    assert dots[:3, contacts.EXTRA_CONTACTS].tolist() == [1.0, 0.0, 0.0]
    np.testing.assert_array_equal(dots[:3, contacts.LOADING_WORK], [2.0, 2.0, math.nan])
    assert dots[0, contacts.FLIGHT_TIME] == pytest.approx(0.1)
    assert math.isnan(dots[1, contacts.CONTACT_TIME])
    quality = np.empty(6)
    contacts.write_quality(dots, 3, quality)
    assert quality.tolist() == pytest.approx([2.0, 1.0, 1.0, 1.0, 0.1, 0.5])


def test_the_terms_of_the_ledger_are_its_fields() -> None:
    assert tuple(field.name for field in dataclasses.fields(Ledger)) == energy.TERMS


@given(st.lists(st.floats(-0.5, 1.5, width=32), min_size=1, max_size=40), st.floats(0.1, 10.0))
def test_codes_divide_the_range_evenly(places: list[float], scale: float) -> None:
    x = np.float32([[*np.float32(places) * np.float32(scale), math.nan]])
    packed = np.empty(-(-x.size // 4), np.int64)
    codes.write_codes(x, 0.0, scale, packed)
    found = packed.view(np.uint16)[: x.size]
    assert found[-1] == codes.GAP
    clipped = np.clip(x[0, :-1], 0.0, scale)
    np.testing.assert_allclose(found[:-1] / (codes.GAP - 1) * scale, clipped, atol=1.1 * scale / codes.GAP)
    ends = np.array([math.inf, -math.inf])
    codes.widen_range(x, ends)
    assert ends.tolist() == [x[0, :-1].min(), x[0, :-1].max()]


@given(st.floats(10.0, 1e3), st.floats(1.0, 1e3), st.integers(1, 64), st.integers(1, 9))
def test_the_trains_of_a_map_are_those_of_the_library(
    low: float, span: float, count: int, pulses: int
) -> None:
    rates, starts, firings = np.empty(count), np.empty(count + 1, np.int64), np.empty(count * pulses)
    codes.write_rates(low, low + span, rates)
    np.testing.assert_array_equal(rates, np.linspace(low, low + span, count))
    pulse = Rectangle(amplitude=1.0, width=1e-4, rise=0.0, decay=0.0)
    slots = np.arange(pulses)
    codes.write_trains(rates, slots, False, starts, firings)
    trains = PulseTrains.at_rates(pulse, rates, pulses)
    np.testing.assert_array_equal(firings.reshape(count, -1), [train.times for train in trains])
    codes.write_trains(rates, slots, True, starts, firings)
    np.testing.assert_array_equal(firings.reshape(count, -1), slots / rates[:, np.newaxis])
    assert starts.tolist() == [k * pulses for k in range(count + 1)]


@given(st.lists(st.floats(-5.0, 5.0), max_size=60))
def test_the_error_of_an_exponent_is_that_of_batch_means(growth: list[float]) -> None:
    out = np.empty(2)
    section.write_exponent(np.reshape(growth, (-1, 1)), np.empty(len(growth) + 1), out)
    assert out[1] == pytest.approx(standard_error(growth), rel=1e-9, abs=1e-12)
    assert out[0] == pytest.approx(math.fsum(growth) / max(len(growth), 1), abs=1e-12)


@given(st.integers(2, 40), st.integers(1, 20), st.integers(0, 2**32 - 1))
def test_the_distances_of_repeats_are_those_of_the_verdict(count: int, period: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    states = np.resize(rng.normal(size=(period, 3)), (count, 3))
    branches = np.resize(rng.integers(0, 2, period), count)
    scales = np.array([1.0, 2.0, 0.5, AGREEMENT])
    out = np.empty(LARGEST_PERIOD)
    found = section.write_distances(states, branches, scales, out)
    expected = repeats(states, branches, scales[:3])
    np.testing.assert_array_equal(out, expected)
    assert (found[0] or None) == period_of(expected)
    closest = int(np.argmin(expected)) + 1 if np.isfinite(expected).any() else 0
    assert found[1] == (found[0] or closest)


@given(
    st.integers(1, 6),
    st.sampled_from([0.0, 1e-12, 1e-5]),
    st.floats(-1.0, 0.9),
    st.integers(0, 2**32 - 1),
)
def test_the_states_decide_the_period_as_in_the_library(
    period: int, size: float, multiplier: float, seed: int
) -> None:
    """States near an orbit, which converge monotonically or alternately."""
    rng = np.random.default_rng(seed)
    decay = multiplier ** (np.arange(120) // period)
    orbit = rng.normal(size=(period, 3)) * rng.choice([1.0, 1e-4])
    states = np.resize(orbit, (120, 3)) + size * rng.normal(size=3) * decay[:, np.newaxis]
    scales = np.array([1.0, 2.0, 0.5])
    agreed = period_of(repeats(states, np.zeros(120, np.int64), scales))
    assume(agreed is not None)
    assert agreed is not None
    counts = [count for count in range(1, agreed + 1) if agreed % count == 0]
    expected = next((count for count in counts if shown((states / scales)[np.newaxis], count)[0]), None)
    assert section.settled_period(states, scales, agreed, True) == (expected or 0)
    by_states = expected or _by_states(states, (states / scales)[np.newaxis], agreed).period
    assert section.settled_period(states, scales, agreed, False) == (by_states or 0)


def test_states_of_a_section_are_those_of_the_library() -> None:
    strobes = np.array([[2.0, 1.0, UNLOADING, 3.0], [1.0, -1.0, UNLOADING, 0.0], [2.0, 0.0, LOADING, 0.0]])
    states, branches = np.empty((3, 3)), np.empty(3, np.int64)
    section.write_states(strobes, 1.5, states, branches)
    np.testing.assert_array_equal(states, strobes[:, [0, 1, 3]])
    np.testing.assert_array_equal(branches, pack_branches(strobes[:, 0], strobes[:, 2].astype(int), 1.5))


@given(
    st.integers(0, 3),
    st.booleans(),
    st.sampled_from([-math.inf, -0.1, 0.01, 0.2]),
    st.booleans(),
    st.integers(0, 3),
)
def test_a_class_is_that_of_the_verdict(
    agreed: int, proved: bool, value: float, smooth: bool, rests: int
) -> None:
    distances = np.full(LARGEST_PERIOD, 1.0)
    if agreed:
        distances[agreed - 1] = 0.0
    factors = np.array([-math.inf] * rests + [0.1])
    exponent = Exponent(value, 0.02, value, 1.0, factors, smooth, "ok")
    reached = settled.Settled(agreed if proved else None, np.zeros((0, 2)))
    judged = verdict(distances, (1, 100), 1e-9, exponent, settled=reached if agreed else None)
    code = section.class_of(agreed, agreed * proved, value, 0.02, smooth, rests)
    names = {section.SUPERSTABLE: "superstable", section.STRANGE: "strange"}
    assert judged.name == (f"period-{code}" if code > 0 else names.get(code, "undecided"))


def test_the_limits_of_settled_states_are_those_of_the_library() -> None:
    own = (section.AGREES, section.DISTINCT, section.SHRINKS, section.NOISE, section.SIGNIFICANT)
    assert own == (settled.AGREES, settled.DISTINCT, settled._SHRINKS, settled._NOISE, SIGNIFICANT)
    search = (newton.GOAL, newton.ENOUGH, newton.ITERATIONS)
    assert search == (settled._GOAL, settled._ENOUGH, settled._ITERATIONS)
    assert (newton.LONGEST_STEP, newton.LEAST_SHARE) == (library._LONGEST_STEP, library._LEAST_SHARE)
    assert (newton.NEAR, newton.LIES_ON) == (settled.NEAR, settled.LIES_ON)
    assert newton.STILL_COIL == STILL_COIL


@dataclasses.dataclass
class Henon:
    """Hénon map, unusable beyond `unusable`, without a derivative beyond `kink`."""

    a: float
    b: float
    unusable: float
    kink: float

    def after(self, state: Any) -> Any:
        return np.array([1.0 - self.a * state[0] ** 2 + state[1], self.b * state[0]])

    def image(self, state: Any) -> tuple[Any, Any, bool, bool]:
        """Image, derivative, differentiability, and whether the image is usable."""
        jacobian = np.array([[-2.0 * self.a * state[0], 1.0], [self.b, 0.0]])
        return self.after(state), jacobian, state[0] <= self.kink, state[0] <= self.unusable

    def __call__(self, states: Any, _firings: Any) -> Images:
        images = Images.empty(len(states))
        for k, (after, jacobian, smooth, usable) in enumerate(map(self.image, states)):
            if usable:
                images.states[k], images.jacobians[k], images.smooth[k] = after, jacobian, smooth
            images.reasons[k] = CLOSED if usable else IN_PACK
        return images


def settled_of(henon: Henon, states: Any, scales: Any, period: int) -> tuple[int, float]:
    """Period and multiplier, computed as in the page."""
    if clear := section.settled_period(states, scales, period, True):
        return clear, math.nan
    for count in (count for count in range(1, period + 1) if period % count == 0):
        orbit, trial, search = np.zeros((count, newton.ORBIT)), np.zeros((count, 2)), np.zeros(4)
        if not newton.write_guess(states, scales, period, count, orbit, trial):
            continue
        images, outcome = np.zeros((count, newton.IMAGE)), newton.TRY
        while outcome == newton.TRY:
            for k in range(count):
                # What is not usable is finite all the same; the images after it are not computed.
                after, jacobian, smooth, usable = henon.image(trial[k])
                images[k] = *after, *jacobian.ravel(), float(smooth)
                if not usable:
                    break
            outcome = newton.improve(images, usable, scales, orbit, trial, search)
        out = np.zeros(1)
        judged = newton.has_settled(states, scales, orbit, search, outcome, out)
        if judged == newton.NO_DERIVATIVE:
            return section.settled_period(states, scales, period, False), math.nan
        if judged == newton.APPROACHES:
            return count, float(out[0])
    return 0, math.nan


@settings(max_examples=400)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1e-3, 1e-2, 1e-1, 1.0]), st.booleans(), st.booleans())
def test_newtons_method_decides_the_period_as_in_the_library(
    seed: int, near: float, limited: bool, kinked: bool
) -> None:
    """States near a period doubling of the Hénon map, which converge slowly to an orbit."""
    rng = np.random.default_rng(seed)
    b = rng.uniform(-0.3, 0.3)
    doubling = 0.75 * (1.0 - b) ** 2
    limits = [rng.uniform(0.0, 1.0) if is_set else math.inf for is_set in (limited, kinked)]
    henon = Henon(doubling * (1.0 + near * rng.uniform(-0.8, 0.6)), b, *limits)
    states = [np.array([0.1, 0.0])]
    wait, count = int(rng.choice([0, 10, 40, 150, 600])), int(rng.integers(8, 80))
    for _ in range(wait + count):
        states.append(henon.after(states[-1]))
        assume(abs(states[-1][0]) < 1e3)
    x, v = np.transpose(states[-count:])
    # A third component of the state counts for the agreement of states alone.
    points, scales = np.column_stack([x, v, 0.3 * x]), np.array([1.3, 0.4, 0.1])
    period = 1 + int(np.argmax(repeats(points, np.zeros(count, np.int64), scales) < 0.5))
    regime: Any = SimpleNamespace(is_planar=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(settled, "ExactMaps", lambda _regime, _effort: henon)
        expected = settled.settled(regime, points, period, scales)
    found, multiplier = settled_of(henon, points, scales, period)
    assert found == (expected.period or 0)
    assert multiplier == pytest.approx(expected.multiplier, abs=1e-9, nan_ok=True)


def kept_of(hammer: ph.Hammer, trains: PulseTrains, ends: Any) -> Any:
    """Raw results of an ensemble, with all extra contacts."""
    (group,) = Ensemble(hammer, trains, ends, tolerance=DISPLAY_TOLERANCE).groups
    job = Job(group, True, True, Ragged.empty(len(ends)), np.zeros(0), np.empty((len(ends), 0), np.float32))
    job.piece(0, len(ends))
    while job.make_room():
        job.piece(0, job.order.size)
    return job.kept


def test_a_printed_line_is_that_of_the_page(hammer: ph.Hammer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Ensemble, "run", _plain(Ensemble.run))
    rate, pulse = 1500.0, hammer.waveform
    assert pulse is not None
    pattern = Pattern("noise", np.random.default_rng(5).random((2, 9, 10)) < 0.6)
    page = print_page(hammer, pattern, rate)
    runs = [np.flatnonzero(row) for row in pattern.dots.reshape(-1, 10)]
    trains = PulseTrains(pulse, [slot_times(slots, rate) for slots in runs])
    ends = np.array([times[-1] for times in trains.firings]) + wait_of(hammer, pulse)
    kept = kept_of(hammer, trains, ends)
    slots = np.concatenate(runs)
    starts = np.cumsum([0, *map(len, runs)])
    firings = np.empty(slots.size)
    line.write_slots(slots, rate, FIRST_SLOT, firings)
    head = head_of(9)
    limits = PRESETS["slots"]
    single = page.nominal
    dots, extra = np.empty((slots.size, line.DOT_WIDTH)), np.empty((1000, 2))
    count = line.write_line(
        (starts, np.arange(18) // 9, np.arange(18) % 9),
        slots,
        firings,
        (kept.status, kept.reached, kept.extra, kept.dot_starts, kept.dots),
        rate,
        np.array([single.force, single.flight_time, single.extra_contacts]),
        np.array([limits.force, limits.arrival, limits.extra_contacts]),
        np.array([head.pitch, head.wire_pitch, head.line_pitch, head.density]),
        dots,
        extra,
    )
    expected = [*page.places, *page.intended, page.darkness, page.fault, page.force_ratio]
    np.testing.assert_array_equal(dots[:, line.FAULT], page.fault)
    np.testing.assert_allclose(dots[:, :7], np.transpose(expected), rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(extra[:count].T, page.extra_places, rtol=1e-12, atol=1e-15)
    totals = np.empty(11)
    line.write_totals(dots, kept.status, totals)
    assert totals[0] == page.good.sum()
    assert totals[1:6].tolist() == list(page.fault_counts.values())
    assert page.lost.any()
    assert count
    assert 0 < totals[0] < slots.size


def _plain(run: Any) -> Any:
    return lambda ensemble, **options: run(ensemble, **{**options, "engine": "plain"})
