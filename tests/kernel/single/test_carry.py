"""Paused and resumed runs, and members run in segments, are bit-identical to uninterrupted runs."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests import hammers

import printhammer as ph
from printhammer.kernel.model.modes import BACKSTOP, HELD, PAUSED, STATUS_NAMES
from printhammer.kernel.single import carry
from printhammer.run import ensemble_group
from printhammer.run.ensemble import Ensemble, EnsembleResult
from printhammer.run.problem import MAX_STEPS, TOLERANCE, Problem, Record, fresh_carry

NODE, OPEN_AT_START = 5, 6
"""Columns of a contact."""


def problem_of(hammer: ph.Hammer, drive: Any, state: tuple[float, float] | None = None) -> Problem:
    start = state or (ph.simulate(hammer, drive, duration=1e-9).at(0.0)[0][0], 0.0)
    return Problem(hammer, drive, start, 0.0, TOLERANCE)


def stretches(problem: Problem, end: float, pause_after: float) -> Iterator[tuple[Any, Any, int, int]]:
    """Nodes, contacts, status and steps of each stretch of a run that pauses."""
    arrays = problem.drive_arrays()
    nodes, contacts = np.empty((4000, 5)), np.empty((400, 7))
    carried = fresh_carry(problem.start, problem.state, pause_after)
    status = PAUSED
    while status == PAUSED:
        status, used, touched, steps = problem.kernel.run(
            (arrays, problem.constants, problem.control, problem.bounds, MAX_STEPS),
            end,
            nodes,
            contacts,
            carried,
        )
        assert used <= len(nodes)
        assert touched <= len(contacts)
        yield nodes[:used].copy(), contacts[:touched].copy(), status, steps
        if touched and carried[carry.MODE] == BACKSTOP:
            contacts[0] = contacts[touched - 1].copy()
        # Nothing that is not carried may be needed.
        nodes[:] = math.nan
        contacts[1:] = math.nan


def paused(problem: Problem, end: float, pause_after: float) -> tuple[Record, int, int]:
    """Return the record of a run that pauses, and the numbers of pauses and of contacts open at a pause."""
    nodes: list[Any] = []
    contacts: list[Any] = []
    pauses = opened = before = total = 0
    for part, found, status, steps in stretches(problem, end, pause_after):
        if pauses:
            # The first node is the last one before the pause, the mode of which may have become one of rest.
            last = nodes[-1][-1]
            np.testing.assert_array_equal(part[0, [0, 1, 2, 4]], last[[0, 1, 2, 4]])
            assert part[0, 3] == last[3] or (part[0, 3], last[3]) in {(HELD, BACKSTOP), (BACKSTOP, HELD)}
            nodes[-1][-1] = part[0]
        open_before = bool(contacts) and math.isnan(contacts[-1][3])
        assert (len(found) > 0 and found[0, NODE] < 0.0) == open_before
        found[:, NODE] += before
        if open_before:
            opened += 1
            found[0, NODE] = contacts[-1][NODE]
            contacts[-1] = found[0]
        contacts.extend(found[1:] if open_before else found)
        nodes.append(part if pauses == 0 else part[1:])
        before = sum(len(rows) for rows in nodes) - 1
        pauses += status == PAUSED
        total = steps
    rows = np.array(contacts).reshape(-1, 7)
    return Record(status, np.concatenate(nodes), rows, total), pauses, opened


def assert_same(mine: Record, whole: Record) -> None:
    assert (mine.status, mine.steps) == (whole.status, whole.steps)
    np.testing.assert_array_equal(mine.nodes, whole.nodes)
    np.testing.assert_array_equal(mine.contacts, whole.contacts)


@pytest.mark.parametrize("pause_after", [2, 3, 5, 8, 31, 100, 1e9])
def test_a_run_that_pauses_is_the_same_run(hammer: ph.Hammer, pause_after: float) -> None:
    problem = problem_of(hammer, ph.PulseTrain(hammer.waveform, period=1.05e-3, pulses=3))
    whole = problem.run(6e-3)
    mine, pauses, opened = paused(problem, 6e-3, pause_after)
    assert_same(mine, whole)
    if pause_after < 10:
        assert pauses > 20
        assert opened > 5
    assert pauses or pause_after > len(whole.nodes)


@settings(max_examples=30)
@given(
    pause_after=st.integers(2, 40),
    period=st.floats(0.3e-3, 2e-3),
    end=st.floats(1e-4, 5e-3),
    x=st.floats(40e-6, 250e-6),
    v=st.floats(-2.0, 2.0),
    overlap=st.sampled_from(["add", "replace"]),
)
def test_pauses_anywhere(
    hammer: ph.Hammer, pause_after: int, period: float, end: float, x: float, v: float, overlap: Any
) -> None:
    drive = ph.PulseTrain(hammer.waveform, period=period, pulses=3, overlap=overlap)
    problem = problem_of(hammer, drive, (x, v))
    assert_same(paused(problem, end, pause_after)[0], problem.run(end))


@pytest.mark.parametrize("pack", ["power", "curve", "dashpot", "dashpot-pull", ""])
@pytest.mark.parametrize("backstop", ["hertz", "hertz-no-pull", "elastomer", "elastomer-pull", "rigid", ""])
def test_pauses_with_every_law(pack: str, backstop: str) -> None:
    made = hammers.made_of(
        spring=hammers.SPRINGS["preload"], pack=hammers.PACKS[pack], backstop=hammers.BACKSTOPS[backstop]
    )
    with hammers.interpreted():
        problem = problem_of(made, hammers.drives("force")["train"], (hammers.STOP, 0.0))
        whole = problem.run(1.2e-3)
        assert STATUS_NAMES[whole.status] in {"ok", "runaway"}
        for pause_after in (2, 7):
            assert_same(paused(problem, 1.2e-3, pause_after)[0], whole)


def test_a_rest_that_is_paused_goes_on(hammer: ph.Hammer) -> None:
    """Paused before the first pulse and after its decay; the record of the remainder is complete."""
    problem = problem_of(hammer, ph.PulseTrain(hammer.waveform, at=[2e-3, 20e-3]))
    whole = problem.run(25e-3)
    assert (whole.nodes[:, 3] == HELD).sum() >= 2
    for pause_after in (2, 3, 4, 50):
        assert_same(paused(problem, 25e-3, pause_after)[0], whole)


def results_of(ensemble: Ensemble) -> EnsembleResult:
    times = np.linspace(0.0, float(ensemble.ends.max()), 701)
    return ensemble.run(dots=True, strobes="firings", times=times, engine="plain", threads=1)


@pytest.mark.parametrize(("nodes", "contacts"), [(4, 1), (6, 2), (9, 1), (64, 16), (200_000, 2000)])
def test_members_with_little_room_are_those_with_much(
    hammer: ph.Hammer, monkeypatch: pytest.MonkeyPatch, nodes: int, contacts: int
) -> None:
    periods = np.linspace(0.3e-3, 2e-3, 12)
    drives = [ph.PulseTrain(hammer.waveform, period=period, pulses=4) for period in periods]
    ensemble = Ensemble(hammer, drives, 3.0 * periods + np.linspace(1e-5, 3e-3, 12))
    much = results_of(ensemble)
    monkeypatch.setattr(ensemble_group, "_NODES", nodes)
    monkeypatch.setattr(ensemble_group, "_CONTACTS", contacts)
    little = results_of(ensemble)
    assert much.ok.all()
    for name in ("status", "reached", "steps", "x"):
        np.testing.assert_array_equal(getattr(little, name), getattr(much, name))
    for table in ("dots", "strobes"):
        for name, column in vars(getattr(much, table)).items():
            np.testing.assert_array_equal(getattr(getattr(little, table), name), column, err_msg=name)
