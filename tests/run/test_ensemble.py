"""Ensembles, one member at a time: every member equals a run of `simulate`."""

import dataclasses
from contextlib import nullcontext
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from tests import hammers
from tests.hammers import STOP, made_of

import printhammer as ph
from printhammer.kernel.model.modes import HELD_UNLOADING, LOADING, RELOADING, STATUS_NAMES, UNLOADING
from printhammer.run.ensemble import Ensemble, EnsembleResult

DOTS = ("flight_time", "impact_speed", "peak_force", "indentation", "contact_time")
# Both branches of the pack tell the force at a reversal; they agree but for rounding.
ROUNDED = ("peak_force", "indentation")
REMEMBERING = (UNLOADING, RELOADING, HELD_UNLOADING)


def same(found: npt.NDArray[Any], expected: list[float | None]) -> None:
    np.testing.assert_array_equal(found, np.array([np.nan if e is None else e for e in expected]))


def check_dots(result: EnsembleResult, i: int, motion: ph.Motion) -> None:
    table, times = result.dots, motion.drive.times
    assert table is not None
    count, width = len(motion.dots), table.fired.shape[1]
    same(table.fired_at[i], [*times, *[None] * (width - len(times))])
    assert table.fired[i].tolist() == [True] * count + [False] * (width - count)
    assert table.struck[i, :count].tolist() == [dot.struck for dot in motion.dots]
    assert table.extra_contacts[i, :count].tolist() == [dot.extra_contacts for dot in motion.dots]
    for name in DOTS:
        expected = [getattr(dot, name) for dot in motion.dots]
        if name in ROUNDED:
            floats = np.array(expected, dtype=np.float64)
            np.testing.assert_allclose(getattr(table, name)[i, :count], floats, rtol=1e-13, err_msg=name)
        else:
            same(getattr(table, name)[i, :count], expected)
        assert np.isnan(getattr(table, name)[i, count:]).all()
    assert not table.struck[i, count:].any()
    assert not table.extra_contacts[i, count:].any()


def check_strobes(result: EnsembleResult, i: int, motion: ph.Motion, times: npt.NDArray[Any]) -> None:
    """States as returned by `Motion.at`; branch and memory from the nodes of the run."""
    table = result.strobes
    assert table is not None
    inside = times[times <= motion.end]
    count, width = len(inside), table.t.shape[1]
    same(table.t[i], [*times, *[None] * (width - len(times))])
    x, v = motion.at(inside) if count else (inside, inside)
    nodes = motion._record.nodes[np.searchsorted(motion.step_times, inside, side="right") - 1]
    memory = np.where(np.isin(nodes[:, 3], REMEMBERING), nodes[:, 4], 0.0)
    for name, expected in {"x": x, "v": v, "memory": memory}.items():
        values = [*expected, *[np.nan] * (width - count)]
        # Two entries of the kernel hold the same code, which the compiler may round differently at the end.
        np.testing.assert_allclose(getattr(table, name)[i], values, rtol=1e-13, atol=1e-16)
    assert table.branch[i].tolist() == [*nodes[:, 3].astype(int), *[-1] * (width - count)]


def check(
    ensemble: Ensemble, *, points: int = 300, odd: bool = False, engine: Any = "plain"
) -> tuple[EnsembleResult, list[ph.Motion]]:
    """Compare all results of an ensemble with the motions of its members."""
    times = np.linspace(0.0, 1.05 * float(ensemble.ends.max()), points)
    # Besides the firings, also the start, the end and beyond.
    strobes: Any = "firings"
    moments = [np.asarray(drive.times) for drive in ensemble.drives]
    if odd:
        strobes = moments = [np.array([0.0, *np.linspace(0.1, 1.0, 7) * t, 2.0 * t]) for t in ensemble.ends]
    result = ensemble.run(dots=True, strobes=strobes, times=times, engine=engine)
    assert result.x is not None
    motions = [ensemble.motion(i) for i in range(ensemble.size)]
    for i, motion in enumerate(motions):
        assert result.status_names[i] == motion.status
        assert (result.reached[i], result.steps[i]) == (motion.end, motion.steps)
        check_dots(result, i, motion)
        check_strobes(result, i, motion, moments[i])
        reached = times[times <= motion.end]
        np.testing.assert_array_equal(result.x[i, : len(reached)], motion.at(reached)[0].astype(np.float32))
        assert np.isnan(result.x[i, len(reached) :]).all()
    assert result.ok.tolist() == [motion.ok for motion in motions]
    return result, motions


@pytest.mark.parametrize("odd", [False, True])
def test_trains_of_every_waveform(hammer: ph.Hammer, odd: bool) -> None:
    drives = [d for name, d in hammers.drives("current").items() if name not in {"replace", "hold"}]
    ends = np.linspace(1.0e-3, 6e-3, len(drives))
    result, motions = check(Ensemble(hammer, drives, ends), odd=odd)
    dots = [dot for motion in motions for dot in motion.dots]
    assert {dot.struck for dot in dots} == {True, False}
    assert result.dots is not None
    assert not result.dots.fired.all()


def test_lost_and_extra_and_open_contacts(hammer: ph.Hammer) -> None:
    drive = ph.PulseTrain(hammer.waveform, period=1.05e-3, pulses=8)
    contacts = [c for c in ph.simulate(hammer, drive).contacts if c.surface == "pack"]
    ends = [0.5 * (c.t_in + c.t_peak) for c in contacts] + [0.5 * (c.t_peak + c.t_out) for c in contacts]
    result, _ = check(Ensemble(hammer, drive, ends), odd=True)
    assert result.dots is not None
    # The contact under way at each end is the latest dot: struck, and not over.
    open_dots = result.dots.struck & np.isnan(result.dots.contact_time)
    assert (open_dots.sum(axis=1) == 1).all()


def test_further_contacts_after_one_firing(hammer: ph.Hammer) -> None:
    """Thrown at the paper, the wire returns to the paper while a long weak pulse is active."""
    drives = [ph.PulseTrain(w["long"]) for w in (hammers.waveforms(a, "current") for a in (0.2, 0.34, 0.6))]
    result, _ = check(Ensemble(hammer, drives, 3e-3, states=(150e-6, 3.0)), odd=True)
    assert result.dots is not None
    assert (result.dots.extra_contacts[:, 0] > 0).all()


def test_different_hammers_and_laws_in_one_ensemble() -> None:
    draw = hammers.Draw(np.random.default_rng(3))
    crude = hammers.crude()
    every: list[ph.Hammer] = [crude, draw(), draw(), crude, hammers.shelf()]
    drives: list[Any] = [
        ph.PulseTrain(h.waveform, period=0.9e-3, pulses=i + 1) for i, h in enumerate(every[:4])
    ]
    drives.append(hammers.drives("force")["train"])
    drives[3] = ph.PulseTrain(crude.waveform, period=0.3e-3, pulses=6, overlap="replace")
    found = Ensemble(every, drives, 3e-3)
    assert len(found.groups) == 3
    check(found)


# Each backstop, and in turn currents and forces; the slow ones are the other way round.
LAWS = [
    pytest.param(magnet, backstop, marks=[pytest.mark.slow] if (turn + side) % 2 else [])
    for turn, backstop in enumerate(hammers.BACKSTOPS)
    for side, magnet in enumerate(["inverse-root", ""])
]


@pytest.mark.parametrize(("magnet", "backstop"), LAWS)
def test_every_law(magnet: str, backstop: str) -> None:
    parts = {"magnet": hammers.MAGNETS[magnet], "spring": hammers.SPRINGS["linear" if magnet else "preload"]}
    every = [
        made_of(**parts, pack=pack, backstop=hammers.BACKSTOPS[backstop]) for pack in hammers.PACKS.values()
    ]
    drives = hammers.drives("current" if magnet else "force")
    state = (STOP if backstop else 120e-6, 0.0)
    with hammers.interpreted():
        check(Ensemble(every, drives["train"], 1.3e-3, states=state, tolerance=1e-6), points=40)


def test_force_drives() -> None:
    drives = hammers.drives("force")
    shelf = hammers.shelf()
    _, motions = check(Ensemble(shelf, list(drives.values()), 4e-3, states=(STOP, 0.0)), odd=True)
    assert any(dot.struck for motion in motions for dot in motion.dots)


def test_a_contact_open_at_the_start_makes_no_dot(hammer: ph.Hammer) -> None:
    front = hammer.front
    assert front is not None
    states = [
        (front + 20e-6, 1.0),
        (front + 20e-6, -0.1),
        (front + 1e-6, 0.0),
        (STOP - 1e-6, -0.1),
        (front, 0.5),
    ]
    drive = ph.PulseTrain(hammer.waveform, at=[0.0, 0.7e-3])
    result, motions = check(Ensemble(hammer, drive, 2e-3, states=states), odd=True)
    assert all(motion.contacts[0].initial for motion in motions)
    assert result.dots is not None
    # What was struck was left before.
    assert (result.dots.flight_time[:, 0] > 1e-5).tolist() == result.dots.struck[:, 0].tolist()


def test_runs_that_fail_are_rows(hammer: ph.Hammer) -> None:
    drives = [ph.PulseTrain(hammer.waveform, period=1e-3, pulses=3)] * 3
    narrow = hammer.replace({"magnet.range_max": 230e-6})
    away = made_of(spring=hammers.preload(50.0), pack=None, backstop=hammers.hertz(damping=4e8))
    every = [hammer, narrow, hammer]
    result, _ = check(Ensemble(every, drives, 4e-3), odd=True)
    assert result.status_names == ["ok", "range left", "ok"]
    with hammers.interpreted():
        result, _ = check(Ensemble(away, hammers.block(0.0, 1e-4, 1.0), [1e-3, 0.2], states=(STOP, 0.0)))
    assert result.status_names == ["ok", "runaway"]
    assert set(result.status) <= set(range(len(STATUS_NAMES)))


@pytest.mark.parametrize("branch", [LOADING, UNLOADING, RELOADING])
def test_a_start_on_a_branch_goes_on_with_the_run(hammer: ph.Hammer, branch: int) -> None:
    """A run cut inside the pack and restarted there has the same force law and leaves the paper equally."""
    # These laws no other test compiles.
    with hammers.interpreted() if branch == RELOADING else nullcontext():
        if branch == RELOADING:
            hammer = hammer.replace({"pack.reloading": "unloading-curve"})
        # A long pulse over the contact pushes the wire in again.
        drive = ph.PulseTrain(hammers.waveforms(2.2, "current")["long"])
        whole = ph.simulate(hammer, drive, duration=2e-3)
        nodes = whole._record.nodes
        inside = np.flatnonzero((nodes[:, 3] == branch) & (nodes[:, 0] > 1e-4) & (nodes[:, 0] < 1.5e-3))
        assert len(inside), "no such branch in this run"
        for row in inside[[len(inside) // 3, -1]]:
            t, x, v, mode, memory = nodes[row]
            # The drive has been constant since, and stays so.
            later = hammers.block(float(drive.value(t)), 1.0, 0.0, "current")
            kept = memory if branch != LOADING else 0.0
            until = 1.6e-3 - t
            found = Ensemble(hammer, later, until, states=(x, v, mode, kept)).run(
                dots=True, strobes=[[0.0, 0.5 * until, until]], engine="plain"
            )
            assert found.strobes is not None
            assert found.dots is not None
            assert found.strobes.branch[0, 0] == branch
            assert found.strobes.memory[0, 0] == kept
            truth = whole.at([t, t + 0.5 * until, t + until])
            np.testing.assert_allclose(found.strobes.x[0], truth[0], rtol=0.0, atol=1e-8 * hammers.STROKE)
            motion = Ensemble(hammer, later, until, states=(x, v, mode, kept)).motion(0)
            np.testing.assert_allclose(
                motion.at([0.0, 0.5 * until, until])[0], truth[0], rtol=0.0, atol=1e-8 * hammers.STROKE
            )


def test_what_is_not_asked_for_is_not_there(hammer: ph.Hammer) -> None:
    found = Ensemble(hammer, ph.PulseTrain(hammer.waveform), 1e-3).run(engine="plain")
    assert (found.dots, found.strobes, found.x) == (None, None, None)
    assert dataclasses.is_dataclass(found)


def test_an_array_for_the_displacements_is_filled(hammer: ph.Hammer) -> None:
    times = np.linspace(0.0, 2e-3, 50)
    ensemble = Ensemble(hammer, ph.PulseTrain(hammer.waveform), [1e-3, 2e-3, 3e-3])
    room = np.full((3, 50), 7.0, np.float32)
    found = ensemble.run(times=times, x=room, engine="plain")
    assert found.x is room
    np.testing.assert_array_equal(room, ensemble.run(times=times, engine="plain").x)


def test_an_ensemble_of_nobody() -> None:
    found = Ensemble([], [], []).run(dots=True, strobes="firings", times=[0.0, 1e-3])
    assert found.dots is not None
    assert found.strobes is not None
    assert found.x is not None
    shapes = {found.status.shape, found.reached.shape, found.ok.shape}
    assert shapes == {(0,)}
    assert (found.dots.struck.shape, found.strobes.x.shape, found.x.shape) == ((0, 0), (0, 0), (0, 2))
    assert found.status_names == []
