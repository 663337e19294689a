"""Machine code compiled ahead by a second process."""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import printhammer as ph
from printhammer.kernel.compile import cache, specialise
from printhammer.kernel.compile.specialise import AHEAD, Kernel
from printhammer.kernel.model.laws import Laws
from printhammer.run import ahead
from printhammer.run.problem import laws_of
from printhammer.run.simulate import announce_compiling


def entry(name: str) -> Any:
    """Return an entry point without machine code."""
    code = SimpleNamespace(with_it=(), can_be_kept=True)
    return SimpleNamespace(name=name, code=code, is_ready=lambda: False, function=lambda: name)


@pytest.fixture
def kernel() -> Kernel:
    names = ("run", "members", *AHEAD)
    return Kernel(Laws("", "", "", "", "absent"), "some laws", [entry(name) for name in names])


def test_the_second_process_begins_with_the_run_and_is_waited_for_once(
    kernel: Kernel, monkeypatch: pytest.MonkeyPatch
) -> None:
    happened: list[Any] = []

    def begin(laws: Laws) -> Any:
        happened.append(laws)
        return lambda: happened.append("waited")

    monkeypatch.setattr(specialise, "begin_ahead", begin)
    for name in ("members", "run", "members", "peaks", "quadratures"):
        assert getattr(kernel, name) == name
        happened.append(name)
    laws = kernel.laws
    assert happened == ["members", laws, "run", "members", "waited", "peaks", "quadratures"]


def test_no_process_begins_unasked(kernel: Kernel, monkeypatch: pytest.MonkeyPatch) -> None:
    def never(_laws: Laws) -> Any:
        raise AssertionError

    monkeypatch.setattr(cache, "listeners", set())
    monkeypatch.setattr(ahead, "begin", never)
    end = announce_compiling(lambda _sentence: None)
    assert specialise.begin_ahead is never
    end()
    assert kernel.run == "run"


def test_laws_that_the_second_process_cannot_import_are_no_trouble() -> None:
    ahead.begin(Laws("a.part.file", "", "", "", "printhammer.parts.absent"))()


@pytest.mark.slow
def test_what_is_made_ahead_is_what_a_motion_loads(hammer: ph.Hammer, tmp_path: Path) -> None:
    laws = laws_of(hammer, ph.PulseTrain(hammer.waveform))
    where = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    # Lowered modules are taken over from other tests, machine code is not.
    if (known := cache.File("any")._written) is not None:
        (tmp_path / known.name).mkdir()
        for path in known.glob("*.bc"):
            shutil.copy(path, tmp_path / known.name)
    told = json.dumps(asdict(laws))
    subprocess.run([sys.executable, "-m", ahead.__name__, told], env=where, check=True)
    made = {path.name for path in tmp_path.rglob("*.code")}
    assert len(made) == len(AHEAD)
    hammer.save(tmp_path / "hammer.toml")
    code = f"""
import printhammer as ph
hammer = ph.load({str(tmp_path / "hammer.toml")!r})
motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform))
_ = motion.dots, motion.energy
"""
    subprocess.run([sys.executable, "-c", code], env=where, check=True)
    fresh = {path.name for path in tmp_path.rglob("*.code")} - made
    assert [name.partition("_")[0] for name in fresh] == ["run"]
