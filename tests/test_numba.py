"""The program with several versions of numba and llvmlite, in the interpreters of PRINTHAMMER_PYTHONS.

`make test-numba` names an environment with the oldest numba that is allowed and one with the newest, with one
wheel installed in both; without the variable the tests use the interpreter that runs them.
"""

import json
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from scipy.special import ellipk

import printhammer as ph
from printhammer.parts.backstop import hertz

PYTHONS = os.environ.get("PRINTHAMMER_PYTHONS", sys.executable).split(os.pathsep)
ROOT = Path(__file__).parents[1]
CUBIC = ROOT / "examples" / "cubic_spring.py"

VERBS = """
import contextlib, io, sys
from printhammer.cli.main import main
for verb in (
    "run {name} --at 0us,1ms",
    "run {name} --scheme trapezoid --at 0us,1ms",
    "map {name} --rates 5 --times 20 --pulses 2",
    "strobe {name} --rate 900Hz --points 20 --no-verdict",
    "lyapunov {name} --rate 900Hz --firings 20 --transient 10",
    "print --hammer {name} --rate 900Hz --force I",
    "hammer show {name}",
):
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        try:
            main(verb.format(name="hendriks-1983").split())
        except SystemExit as end:
            assert not end.code, verb
    assert printed.getvalue(), verb
print("[]" if "numba" not in sys.modules else "[1]")
"""

OSCILLATOR = """
import json
import printhammer as ph
from printhammer.parts.outside import load_parts
load_parts("cubic_spring.py")
spring = {"law": "hardening", "stiffness": "1 N/m", "cubic": "1 N/m^3"}
hammer = ph.Hammer.build("1 kg", spring=spring)
motion = ph.simulate(hammer, ph.SineForce(0.0, 1.0), duration=PERIOD, state=(1.0, 0.0), tolerance=1e-10)
print(json.dumps([motion.x[-1], motion.v[-1], motion.energy.residual]))
"""

SIDE_BY_SIDE = """
import json
import numpy as np
import printhammer as ph
from printhammer.parts.outside import load_parts
load_parts("own_hertz.py")
dots = []
for hammer in (ph.load("own.toml"), ph.load("hendriks-1983")):
    drives = [ph.PulseTrain(hammer.waveform, rate=600.0 + 10.0 * member, pulses=2) for member in range(32)]
    table = ph.Ensemble(hammer, drives, 3e-3).run(dots=True, engine="lanes").dots
    dots.append([np.nan_to_num(column).ravel().tolist() for column in (table.impact_speed, table.peak_force)])
print(json.dumps(dots))
"""


def result_of(python: str, code: str, folder: Path) -> Any:
    environment = dict(os.environ)
    if python != sys.executable:
        # Another environment has a package of its own, and nothing is compiled yet.
        environment.pop("PYTHONPATH", None)
        environment["NUMBA_CACHE_DIR"] = str(folder / "cache")
    done = subprocess.run(
        [python, "-c", code], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "made anew" not in done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.slow
@pytest.mark.parametrize("python", PYTHONS)
def test_shipped_hammers_need_no_numba(python: str, tmp_path: Path) -> None:
    if python != sys.executable:
        # The wheel of tests/test_packaging.py holds the machine code of two hammers only.
        (wheel,) = (ROOT / "build" / "wheel").glob("*.whl")
        assert wheel.stat().st_size <= 8_000_000
    # In a checkout, the first call lowers the modules.
    calls = [VERBS] if python != sys.executable else [VERBS, VERBS]
    assert [result_of(python, call, tmp_path) for call in calls][-1] == []


@pytest.mark.slow
@pytest.mark.parametrize("python", PYTHONS)
def test_a_law_of_ones_own(python: str, tmp_path: Path) -> None:
    (tmp_path / CUBIC.name).write_bytes(CUBIC.read_bytes())
    # Duffing's oscillator x'' + x + x^3 = 0 with amplitude 1, an elliptic function of parameter 1/4.
    period = 4.0 * float(ellipk(0.25)) / math.sqrt(2.0)
    x, v, residual = result_of(python, OSCILLATOR.replace("PERIOD", repr(period)), tmp_path)
    assert x == pytest.approx(1.0, abs=1e-8)
    assert v == pytest.approx(0.0, abs=1e-7)
    assert residual == pytest.approx(0.0, abs=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("python", PYTHONS)
def test_a_law_of_ones_own_in_lanes(python: str, tmp_path: Path) -> None:
    law = Path(hertz.__file__).read_text("utf-8")
    (tmp_path / "own_hertz.py").write_text(law.replace('str] = "hertz"', 'str] = "own-hertz"'), "utf-8")
    file = tmp_path / "own.toml"
    ph.load("hendriks-1983").save(file)
    file.write_text(file.read_text("utf-8").replace('law = "hertz"', 'law = "own-hertz"'), "utf-8")
    own, expected = result_of(python, SIDE_BY_SIDE, tmp_path)
    assert sum(speed > 0.0 for speed in own[0]) >= 32
    for mine, theirs in zip(own, expected, strict=True):
        assert mine == pytest.approx(theirs, rel=1e-7)
