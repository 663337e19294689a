"""Ensembles: invalid input, progress, interruption, and errors in worker threads."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests import hammers
from tests.errors import refused

import printhammer as ph
from printhammer.run import ensemble_group
from printhammer.run.ensemble import Ensemble

END = 1e-3


def drive() -> ph.PulseTrain:
    return ph.PulseTrain(hammers.crude().waveform)


def made(hammer: Any = None, drives: Any = None, ends: Any = END, **options: Any) -> Ensemble:
    return Ensemble(hammer or hammers.crude(), drives or drive(), ends, **options)


@pytest.mark.parametrize(
    ("make", "key"),
    [
        (lambda: made(drives=[drive()] * 3, ends=[END] * 2), "ends"),
        (lambda: made([hammers.crude()] * 2, [drive()] * 3), "hammers"),
        (lambda: made(drives=[drive()] * 2, ends=[END] * 3), "drives"),
        (lambda: made(ends=[END] * 3, states=[[6e-5, 0.0]] * 2), "states"),
        (lambda: made("hendriks-1983"), "hammers"),
        (lambda: made(drives=[hammers.crude().waveform]), "drives"),
        (lambda: made(ends=0.0), "ends"),
        (lambda: made(ends=[END, -1.0]), "ends"),
        (lambda: made(ends=np.inf), "ends"),
        (lambda: made(ends=np.nan), "ends"),
        (lambda: made(ends="1 ms"), "ends"),
        (lambda: made(ends=[[END]]), "ends"),
        (lambda: made(states=5.0), "states"),
        (lambda: made(states=[1e-4, 0.0, 1.0]), "states"),
        (lambda: made(states=np.zeros((2, 2, 2))), "states"),
        (lambda: made(states=(np.nan, 0.0)), "state"),
        (lambda: made(states=(-1e-6, 0.0)), "state"),
        (lambda: made(states=(2.5e-4, 0.0, 0.0, 0.0)), "branch"),
        (lambda: made(states=(2.5e-4, 0.0, 99.0, 0.0)), "branch"),
        (lambda: made(states=(2.5e-4, 0.0, 1.5, 0.0)), "branch"),
        (lambda: made(states=(1e-4, 0.0, 2.0, 3e-4)), "x"),
        (lambda: made(states=(2.5e-4, 0.0, 2.0, 2.4e-4)), "memory"),
        (lambda: made(tolerance=0.0), "tolerance"),
        (lambda: made(tolerance=1.0), "tolerance"),
        (lambda: made(tolerance=np.nan), "tolerance"),
        (lambda: made(tolerance="1e-9"), "tolerance"),
        (lambda: made().run(engine="fast"), "engine"),
        (lambda: made().run(threads=0), "threads"),
        (lambda: made().run(strobes="firing"), "strobes"),
        (lambda: made().run(strobes=3), "strobes"),
        (lambda: made().run(strobes=[[0.0]] * 2), "strobes"),
        (lambda: made().run(strobes=[[2e-4, 1e-4]]), "strobes"),
        (lambda: made().run(strobes=[[np.nan]]), "strobes"),
        (lambda: made().run(times=[2e-4, 1e-4]), "times"),
        (lambda: made().run(times=[-1e-4, 1e-4]), "times"),
        (lambda: made().run(times=[0.0, np.inf]), "times"),
        (
            lambda: made().run(times=[0.0], x=np.zeros((2, 1), np.float32)),
            "x",
        ),
        (lambda: made().run(times=[0.0], x=np.zeros((1, 1))), "x"),
        (lambda: made().run(times=[0, 1e-4], x=np.zeros((1, 4), np.float32)[:, ::2]), "x"),
        (lambda: made().run(x=np.zeros((1, 4), np.float32)), "x"),
    ],
)
def test_one_sentence(make: Callable[[], Any], key: str) -> None:
    with refused(key):
        make()


def test_no_rest_state_to_start_from() -> None:
    thrown = hammers.made_of(spring=hammers.preload(4.0))
    force = hammers.block(1.0, 1e-4)
    with pytest.raises(ph.InputError):
        Ensemble(thrown, force, END)
    assert Ensemble(thrown, force, END, states=(0.0, 0.0)).size == 1


def test_lanes_for_laws_that_they_are_not_for() -> None:
    rigid = hammers.made_of(spring=hammers.preload(-4.0), pack=hammers.power(), backstop=hammers.rigid(0.5))
    with refused("engine"):
        Ensemble(rigid, hammers.idle(), END, states=(1e-4, 0.0)).run(engine="lanes")


def test_a_start_on_a_branch_runs_by_itself() -> None:
    ensemble = made(states=(2.5e-4, 0.1, 1.0, 0.0))
    with refused("engine"):
        ensemble.run(engine="lanes")
    assert ensemble.run().ok.all()


@pytest.mark.parametrize("engine", ["plain", "lanes"])
@pytest.mark.parametrize("threads", [1, 2])
def test_progress_reaches_the_total(engine: Any, threads: int) -> None:
    ends = np.linspace(1e-4, 4e-3, 700)
    told: list[tuple[int, int]] = []
    made(ends=ends).run(engine=engine, threads=threads, progress=lambda *numbers: told.append(numbers))
    assert told[-1] == (700, 700)
    assert {total for _, total in told} == {700}
    assert [done for done, _ in told] == sorted(done for done, _ in told)


@pytest.mark.parametrize("engine", ["plain", "lanes"])
@pytest.mark.parametrize("threads", [1, 2])
def test_an_interruption_passes_through(engine: Any, threads: int) -> None:
    def interrupt(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        made(ends=np.full(2000, 3e-3)).run(engine=engine, threads=threads, progress=interrupt)


@pytest.mark.parametrize("threads", [1, 2])
def test_an_error_of_a_worker_comes_out(monkeypatch: pytest.MonkeyPatch, threads: int) -> None:
    def odd(job: Any, first: int, last: int) -> None:
        raise OSError("no room for a member")

    monkeypatch.setattr(ensemble_group.Job, "piece", odd)
    with pytest.raises(OSError, match="no room for a member"):
        made(ends=np.full(64, END)).run(engine="plain", threads=threads)
