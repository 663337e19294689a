"""Modules of an entry point: loading, rebuilding, distinguishing; and the kernel linked from them."""

import lzma
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests import linked
from tests.errors import refused

import printhammer as ph
from printhammer.kernel.compile import cache, link, modules
from printhammer.kernel.compile.bindings import bindings_of
from printhammer.kernel.compile.modules import Entry, Module
from printhammer.kernel.compile.specialise import is_interpreted, specialise
from printhammer.kernel.model.laws import LAW_FUNCTIONS, Laws
from printhammer.run.problem import Problem, laws_of

HERTZ = Laws(
    "", "printhammer.parts.spring.linear", "", "printhammer.parts.backstop.hertz", "printhammer.parts.absent"
)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty module folder, without shipped modules."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(modules, "SHIPPED", tmp_path / "shipped")
    (tmp_path / "shipped").mkdir()
    return tmp_path


def unmade() -> bytes:
    raise AssertionError


def bitcode_of(value: int) -> bytes:
    import llvmlite.binding as llvm

    return bytes(llvm.parse_assembly(f"@value = constant i64 {value}").as_bitcode())


def test_a_module_is_made_once(folder: Path) -> None:
    assert Module("spring", "its source", lambda: bitcode_of(1)).content() == bitcode_of(1)
    assert Module("spring", "its source", unmade).content() == bitcode_of(1)
    assert Module("spring", "other source", lambda: bitcode_of(2)).content() == bitcode_of(2)
    assert Module("pack", "its source", lambda: bitcode_of(3)).content() == bitcode_of(3)


def test_a_module_that_ships_is_not_made(folder: Path) -> None:
    module = Module("spring", "its source", unmade)
    before = module.identity()
    module.shipped.write_bytes(lzma.compress(bitcode_of(1)))
    assert module.content() == bitcode_of(1)
    # Machine code of the one that was made here is not that of the one that ships.
    assert module.identity() != before


@pytest.mark.parametrize(
    "content", [b"", lzma.compress(b"BC of another LLVM"), lzma.compress(bitcode_of(1))[:-9]]
)
def test_a_shipped_module_that_cannot_be_read_is_made_again_and_said_once(
    folder: Path, monkeypatch: pytest.MonkeyPatch, content: bytes
) -> None:
    sentences: list[str] = []
    monkeypatch.setattr(cache, "_said", set())
    monkeypatch.setattr(cache, "listeners", {sentences.append})
    module = Module("spring", "its source", lambda: bitcode_of(2))
    module.shipped.write_bytes(content)
    assert [module.content(), module.content()] == [bitcode_of(2)] * 2
    (sentence,) = sentences
    assert sentence == f"{module.shipped}: the module cannot be read; it is made anew"


@pytest.mark.parametrize(
    "change", [{"spring": ""}, {"backstop_pulls": False}, {"circuit": True}, {"force_drive": True}]
)
def test_machine_code_is_named_after_laws_and_choices(change: dict[str, Any]) -> None:
    def name(laws: Laws) -> str:
        variant = {"HAS_CIRCUIT": laws.circuit}
        return Entry("run", variant, bindings_of(laws), {}, "laws").code.name

    other = Laws(**{**vars(HERTZ), **change})
    assert name(HERTZ) == name(HERTZ)
    assert name(HERTZ) != name(other)


OWN_LAW = """
import math

def backstop_elastic(c, w):
    return c[1] * cube(w)

def cube(w):
    return w * w * w

def backstop_viscous(c, w, v):
    return -c[2] * w * v

def backstop_energy(c, w):
    return 0.4 * c[1] * math.pow(w, 5.0)

def backstop_switch(c, w, v):
    return 1.0
"""


@pytest.mark.parametrize("for_lanes", [False, True])
def test_a_law_of_ones_own_is_lowered_by_the_public_interface_of_numba(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, for_lanes: bool
) -> None:
    import llvmlite.binding as llvm

    (tmp_path / "own_backstop.py").write_text(OWN_LAW)
    monkeypatch.syspath_prepend(tmp_path)
    laws = Laws("", "", "", "own_backstop", "printhammer.parts.absent")
    monkeypatch.setitem(sys.modules, "printhammer.kernel.compile.lower", None)
    content = modules.laws_of("backstop", bindings_of(laws), for_lanes)._make()
    defined = {
        function.name
        for function in llvm.parse_bitcode(content).functions
        if not function.is_declaration and function.linkage == llvm.Linkage.external
    }
    assert defined == {link.law_symbol(name, for_lanes) for name in LAW_FUNCTIONS["backstop"]}


@pytest.mark.parametrize(("role", "module"), [("backstop", "own_backstop"), ("spring", "")])
def test_without_numba_a_module_that_has_to_be_lowered_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, role: str, module: str
) -> None:
    (tmp_path / "own_backstop.py").write_text(OWN_LAW)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(sys.modules, "numba", None)
    parts = {"magnet": "", "spring": "", "pack": "", "backstop": "", role: module}
    with refused(key="laws"):
        modules.laws_of(role, bindings_of(Laws(**parts, absent="printhammer.parts.absent")), False)._make()


def test_a_law_of_ones_own_computes_what_the_same_law_that_ships_computes(
    hammer: ph.Hammer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from printhammer.parts.backstop import hertz

    source = Path(hertz.__file__).read_text("utf-8").partition("@register")[0]
    (tmp_path / "own_hertz.py").write_text(source)
    monkeypatch.syspath_prepend(tmp_path)
    drive = ph.PulseTrain(hammer.waveform, period=1e-3, pulses=3)
    problem = Problem(hammer, drive, (hammer.position or 0.0, 0.0), 0.0, 1e-9)
    shipped = problem.run(4e-3)
    problem.__dict__["kernel"] = specialise(replace(laws_of(hammer, drive), backstop="own_hertz"))
    own = problem.run(4e-3)
    assert own.steps == shipped.steps > 50
    np.testing.assert_array_equal(own.nodes, shipped.nodes)
    np.testing.assert_array_equal(own.contacts, shipped.contacts)


VERBS = (
    "run {hammer} --at 0us,1ms",
    "map {hammer} --rates 5 --times 20 --pulses 2",
    "strobe {hammer} --rate 900Hz --points 20 --no-verdict",
    "lyapunov {hammer} --rate 900Hz --firings 20 --transient 10",
    "print --hammer {hammer} --rate 900Hz --force I",
    "hammer show {hammer}",
)


def test_nothing_of_numba_is_loaded_once_the_machine_code_is_on_disk(
    hammer: ph.Hammer, tmp_path: Path
) -> None:
    """Neither the library nor a verb loads numba."""
    hammer.save(tmp_path / "hammer.toml")
    verbs = [verb.format(hammer=tmp_path / "hammer.toml").split() for verb in VERBS]
    code = f"""
import sys
import printhammer as ph
hammer = ph.load({str(tmp_path / "hammer.toml")!r})
motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform))
_ = motion.dots, motion.energy, motion.x
drives = [ph.PulseTrain(hammer.waveform, rate=rate) for rate in (900.0, 1000.0)]
ph.Ensemble(hammer, drives, 3e-3).run(dots=True)
def names():
    return [name for name in sys.modules if name.partition(".")[0] == "numba"]
loaded = {{"library": names()}}
from printhammer.cli.main import main
for verb in {verbs!r}:
    sys.argv = ["printhammer", *verb]
    try:
        main()
    except SystemExit as end:
        assert not end.code, verb
    loaded[verb[0]] = names()
print(loaded)
"""
    done = ""
    expected: dict[str, list[str]] = {"library": [], **{verb[0]: [] for verb in verbs}}
    # The first one makes what is not there, if anything.
    for _ in range(2):
        run = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert run.returncode == 0, run.stderr
        done = run.stdout.splitlines()[-1]
        if done == str(expected):
            break
    assert done == str(expected)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hendriks-1983", "relay-5v"])
def test_what_is_linked_gives_the_bits_of_what_is_compiled_with_its_laws(name: str) -> None:
    found = linked.of_shipped(name)
    assert found.linked.steps == found.whole.steps > 50
    assert found.equal


@pytest.mark.slow
@pytest.mark.parametrize("names", linked.sample(2), ids=str)
def test_random_combinations_give_what_is_compiled_with_their_laws(
    names: tuple[str, str, str, str, bool],
) -> None:
    found = linked.of_combination(*names)
    assert found.linked.steps == found.whole.steps > 50
    # Other functions are inlined, and other products contracted: rounding errors may differ.
    assert found.equal or found.error < 1e-11


def test_kernels_are_compiled_where_numba_is_blocked(monkeypatch: pytest.MonkeyPatch) -> None:
    """None in `sys.modules` blocks the import; the variable alone then decides."""
    monkeypatch.setitem(sys.modules, "numba", None)
    for value, expected in (("0", False), ("1", True)):
        monkeypatch.setenv("NUMBA_DISABLE_JIT", value)
        assert is_interpreted() is expected
