"""The peer solvers of the benchmark: they solve the same problem, and a missing solver is reported."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from benchmarks.solvers import exact
from benchmarks.solvers.entry import Absent, Peers, load_peers
from benchmarks.solvers.problem import Task, frozen
from tests.errors import refused

import printhammer as ph

if TYPE_CHECKING:
    from collections.abc import Callable

    from benchmarks.solvers.entry import Entry

FOLDER = Path(__file__).parents[2] / "benchmarks" / "peers"


@pytest.fixture(scope="module")
def task() -> Task:
    return frozen()


@pytest.fixture(scope="module")
def peers() -> Peers:
    return load_peers(FOLDER)


@pytest.fixture(scope="module")
def module(peers: Peers) -> Callable[[str], Any]:
    return lambda name: importlib.import_module(
        f"{peers.single['SciPy'].__module__.rpartition('.')[0]}.{name}"
    )


@pytest.mark.parametrize(
    ("text", "key"),
    [(None, "peers"), ("import no_such_module", "peers"), ("ENSEMBLES = {}", "peers")],
)
def test_a_folder_without_peers_is_refused(tmp_path: Path, text: str | None, key: str) -> None:
    if text is not None:
        (tmp_path / "__init__.py").write_text(text, "utf-8")
    with refused(key):
        load_peers(tmp_path)


def test_the_pieces_are_the_current_of_the_drive(task: Task, module: Callable[[str], Any]) -> None:
    pieces = module("equations").current_pieces(task, 5e-3)
    np.testing.assert_array_equal(pieces[1:, 0], pieces[:-1, 1])
    assert (pieces[0, 0], pieces[-1, 1]) == (0.0, 5e-3)
    times = np.random.default_rng(1).uniform(0.0, 5e-3, 1000)
    row = pieces[np.searchsorted(pieces[:, 0], times, side="right") - 1]
    current = row[:, 2] + row[:, 3] * np.exp(-row[:, 4] * (times - row[:, 0]))
    motion = ph.simulate(task.hammer, task.drive(4), duration=5e-3, times=np.sort(times))
    np.testing.assert_allclose(current[np.argsort(times)], motion.current, atol=1e-11)


def test_scipy_with_its_events_agrees_with_the_reference(task: Task, peers: Peers) -> None:
    entry = peers.single["SciPy"](task, True)[-1]
    assert np.abs(entry.positions() - exact.single(task)).max() < 1e-11


@pytest.mark.parametrize(
    ("module_name", "make"),
    [
        ("numbalsoda", lambda peers, task: peers.single["numbalsoda"](task, True)),
        ("heyoka", lambda peers, task: peers.single["heyoka"](task, True)),
        ("heyoka", lambda peers, task: peers.ensembles["heyoka"](task, True, 8)),
        ("diffrax", lambda peers, task: peers.ensembles["diffrax"](task, True, 8)),
        ("sksundae", lambda peers, task: peers.single["scikit-sundae"](task, True)),
    ],
)
def test_what_is_not_installed_is_absent(
    task: Task,
    peers: Peers,
    monkeypatch: pytest.MonkeyPatch,
    module_name: str,
    make: Callable[[Peers, Task], list[Entry]],
) -> None:
    # An entry of None makes the import fail as if the module were not there.
    monkeypatch.setitem(sys.modules, module_name, None)
    with pytest.raises(Absent, match="not installed"):
        make(peers, task)


def test_without_a_compiler_or_headers_the_cpp_peers_are_absent(
    task: Task, module: Callable[[str], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("CXX", raising=False)
    cplusplus = module("cplusplus")
    monkeypatch.setattr(cplusplus.shutil, "which", lambda _name: None)
    cplusplus._library.cache_clear()
    for make in (cplusplus.odeint, cplusplus.sundials):
        with pytest.raises(Absent, match=r"no C\+\+ compiler"):
            make(task, True)
    monkeypatch.setattr(cplusplus.shutil, "which", lambda _name: "false")
    with pytest.raises(Absent, match=r"boost/version.hpp"):
        cplusplus.odeint(task, True)
    cplusplus._library.cache_clear()
