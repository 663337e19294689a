"""Machine code of the page for the results of a run gives the results of the library."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.webassembly import Wasmtime

import printhammer as ph
from printhammer.derivatives.states import strobe_exponent
from printhammer.hammer.hammer import shipped
from printhammer.kernel.readout import contacts, curves
from printhammer.kernel.readout.sums import PARTIALS
from printhammer.kernel.variational import layout
from printhammer.run.motion import Motion
from printhammer.run.plain.entries import compiled, entries, page_module
from printhammer.run.problem import TOLERANCE, Problem

FEWEST = 300


def fields_of(rows: Any) -> np.ndarray:
    """Fields of dots, without the index, or of an energy ledger, as numbers; None becomes NaN."""
    table = [dataclasses.astuple(row)[1 if hasattr(row, "index") else 0 :] for row in rows]
    return np.array(table, dtype=np.float64)


def machine_code(motion: Motion) -> Callable[..., Any]:
    """Call an entry point by name, as machine code for the laws of a run."""
    return lambda name, *arguments: compiled(name, motion._problem.laws)(*arguments)


def check_read_out(motion: Motion, call: Callable[..., Any]) -> None:
    """Compute the results of a run as a page does, with entry points only, and compare."""
    problem, record = motion._problem, motion._record
    nodes, firings = record.nodes, problem.firings
    times = np.empty(FEWEST + 3 * len(nodes) + 1)
    times = times[: call("curve_times", nodes, FEWEST, 20_000, times)].copy()
    out, largest = np.empty((curves.CURVES, times.size), np.float32), np.empty(1)
    force = motion.drive.quantity == "force"
    call("curves", problem.resample(record, times), force, out, largest)
    x, v, driven, voltage, forces = motion.curves_at(times)
    named = [forces.get(name, np.zeros(times.size)) for name in ph.run.motion.FORCES]
    for own, expected in zip(out, [x, v, driven, voltage, *named], strict=True):
        np.testing.assert_allclose(own, expected, rtol=1e-5, atol=1e-6 * max(1e-9, np.abs(expected).max()))
    steps = np.empty(len(nodes) - 1, np.int64)
    starts, ends = np.empty((2, len(nodes) - 1))
    call("steps", nodes, steps, starts, ends)
    increments = problem.quadratures(record, steps, starts, ends)
    count, work = len(record.contacts), np.empty(PARTIALS)
    rows = np.empty((count, contacts.CONTACT_WIDTH))
    rigid = motion.hammer.backstop is not None and motion.hammer.backstop.law == "rigid"
    peaks = problem.peaks(record)
    call("contacts", record.contacts, nodes, peaks, increments, firings, rigid, work, rows)
    works, starts, ends = np.empty((3, count))
    steps = np.empty(count, np.int64)
    call("loading", rows, nodes, increments, work, works, steps, starts, ends)
    rests = problem.quadratures(record, steps, starts, ends)
    dots = np.empty((firings.size, contacts.DOT_WIDTH))
    found = call("dots", firings, motion.end, rows, works, rests, dots)
    np.testing.assert_array_equal(dots[:found], fields_of(motion.dots).reshape(found, -1))
    drive = problem.drive_arrays()
    call("pack_peaks", record.contacts, nodes, drive, problem.constants, peaks)
    call("contacts", record.contacts, nodes, peaks, increments, firings, rigid, work, rows)
    call("loading", rows, nodes, increments, work, works, steps, starts, ends)
    rests, again = problem.quadratures(record, steps, starts, ends), np.empty_like(dots)
    assert call("dots", firings, motion.end, rows, works, rests, again) == found
    np.testing.assert_allclose(again[:found], dots[:found], rtol=1e-9)
    sums, terms = np.empty(increments.shape[1] + 1), np.empty(15)
    call("sums", increments, work, sums)
    table = problem.resample(record, nodes[[0, -1], 0])
    call("energies", nodes, table, problem.constants, motion.hammer.mass, sums, terms)
    expected = np.array(dataclasses.astuple(motion.energy))
    np.testing.assert_allclose(terms, expected, rtol=1e-9, atol=1e-12 * motion.energy.throughput)


def motion_of(name: str, rng: np.random.Generator) -> Motion:
    """Run a shipped hammer with two changed constants, under its pulse or a sinusoidal force."""
    hammer = ph.load(name)
    keys = [key for key, constant in hammer.constants.items() if constant.si]
    changed: Any = {key: hammer.constants[key].si * rng.uniform(0.95, 1.05) for key in rng.choice(keys, 2)}
    hammer = hammer.replace(changed)
    if hammer.waveform is None:
        return ph.simulate(hammer, ph.SineForce(rng.uniform(0.5, 3.0), rng.uniform(0.5, 3.0)), duration=20.0)
    rate = rng.uniform(0.1, 0.3) / hammer.waveform.support
    return ph.simulate(hammer, ph.PulseTrain(hammer.waveform, rate=rate, pulses=7))


def test_a_run_is_read_out_as_by_the_library() -> None:
    motion = motion_of("hendriks-1983-1", np.random.default_rng(0))
    check_read_out(motion, machine_code(motion))


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped())
def test_runs_of_all_hammers_are_read_out_as_by_the_library(name: str) -> None:
    rng = np.random.default_rng(1)
    tried = 0
    while tried < 3:
        try:
            motion = motion_of(name, rng)
        except ph.InputError:
            continue
        tried += 1
        check_read_out(motion, machine_code(motion))


@pytest.mark.slow
def test_the_module_of_a_page_reads_a_run_out() -> None:
    motion = motion_of("hendriks-1983-1", np.random.default_rng(2))
    host, results = Wasmtime(page_module(motion._problem.laws).content()), entries()

    def call(name: str, *given: Any) -> Any:
        return host.call(name, *given, results=results[name].results if name in results else None)

    check_read_out(motion, call)
    check_exponent(motion.hammer, call)


def check_exponent(hammer: ph.Hammer, call: Callable[..., Any]) -> None:
    """Compute the exponent of an endless train as a page does, and compare."""
    assert hammer.waveform is not None
    first, last, period = 21, 40, 1e-3
    train = ph.PulseTrain(hammer.waveform, period=period, pulses=last)
    problem = Problem(hammer, train, (hammer.rest, 0.0), 0.0, TOLERANCE)
    nodes, marks = problem.run(float(train.times[-1])).nodes, np.array(train.times)
    scale, speed = problem.scales
    initial = np.array([[scale, 0.0], [0.0, speed], [0.0, 0.0]])
    carried = layout.Carried(
        columns=np.zeros((3, 2)),
        work=np.zeros((layout.WORK_ROWS, layout.work_width(2, False))),
        track=np.array([0.0, 1.0, 0.0, 0.0]),
        states=np.full((last, 4), np.nan),
        changes=np.full((last, 3, 2), np.nan),
        growth=np.full((last, 2), np.nan),
        passed=np.zeros((0, 2, 3, 2)),
    )
    parts = problem.drive_arrays(), problem.constants, problem.scales, problem.bounds
    call("flow", nodes, *parts, (), marks, np.zeros(0, np.int64), True, True, initial, carried)
    growth, found = carried.growth[first:].copy(), np.empty(2)
    call("exponent", growth, np.empty(len(growth) + 1), found)
    expected = strobe_exponent(hammer, train, first=first, last=last)
    assert expected.ok
    assert found.tolist() == pytest.approx([expected.value, expected.standard_error], rel=1e-6)
