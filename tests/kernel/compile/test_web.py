"""Kernels in WebAssembly: contents of a module, and agreement with machine code."""

import importlib.util
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numpy as np
import pytest
from tests.errors import refused
from tests.webassembly import Node, Wasmtime

import printhammer as ph
from printhammer.hammer.hammer import shipped
from printhammer.kernel.compile import calls, link
from printhammer.kernel.compile.signatures import signature_of
from printhammer.kernel.compile.specialise import ENTRIES, Kernel
from printhammer.kernel.compile.web import build
from printhammer.kernel.model.layout import INVERSE_MASS
from printhammer.run.plain.entries import page_module
from printhammer.run.problem import Problem, Record
from printhammer.support.arrays import FloatArray

SCALED = """
@table = internal constant [2 x double] [double 2.0, double 3.0]
declare double @pow(double, double)
define i32 @entry(ptr %result, ptr %raised, i8 %b, ptr %o, ptr %p, i64 %n, i64 %size, ptr %data,
                  i64 %l0, i64 %l1, i64 %s0, i64 %s1, double %x) {
%second = getelementptr i8, ptr %data, i64 %s0
%base = load double, ptr getelementptr ([2 x double], ptr @table, i64 0, i64 1)
%power = call double @pow(double %base, double %x)
store double %power, ptr %second
store i64 %n, ptr %result
%place = getelementptr i64, ptr %result, i64 1
%wide = zext i8 %b to i64
store i64 %wide, ptr %place
ret i32 0
}
"""
SIGNATURE = ("b", ("f2", "f"))


def made_object() -> bytes:
    """The object of a function that writes 3 to the power x to the second row of an array."""
    template = bytes(llvm.parse_assembly(SCALED).as_bitcode())
    calling = calls.calling_code(link.ENTRY, SIGNATURE, link.CALL, bare=True)
    return build.emit(link.link(template, [], {}, calling), "run")


def test_an_object_is_one_of_webassembly() -> None:
    content = made_object()
    assert content.startswith(build.MAGIC)
    assert b"pow" in content


def test_a_missing_linker_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "find_spec", lambda name: importlib.util.find_spec(f"{name}_not_here"))
    with refused(key="page"):
        build.join({"run": made_object()}, {})


def test_a_description_names_the_elements_of_named_tuples() -> None:
    which, batch, kept, *_ = build.description_of(signature_of("members", {}))
    assert which == "i1"
    assert batch["firings"] == "f1"
    assert kept["x"] == "s2"
    assert build.description_of(SIGNATURE) == ["b", ["f2", "f"]]


@pytest.mark.parametrize(
    ("number", "encoded"), [(0, b"\0"), (127, b"\x7f"), (128, b"\x80\1"), (624485, b"\xe5\x8e\x26")]
)
def test_lengths_are_encoded_as_the_binary_format_says(number: int, encoded: bytes) -> None:
    assert build._unsigned(number) == encoded


def small_module() -> bytes:
    description = {"entries": {"run": {"arguments": build.description_of(SIGNATURE), "results": 2}}}
    return build.join({"run": made_object()}, description)


@pytest.mark.slow
def test_arguments_and_results_of_a_small_module(tmp_path: Path) -> None:
    path = tmp_path / "small.wasm"
    path.write_bytes(small_module())
    host = Wasmtime(path.read_bytes())
    assert host.imports == []
    with Node(path) as node:
        for call in (host.call, node.call):
            array = np.arange(6.0).reshape(2, 3)
            assert call("run", True, (array, 2.0), results=2) == (6, 1)
            assert array.tolist() == [[0.0, 1.0, 2.0], [9.0, 4.0, 5.0]]
            # More than the memory that a module begins with.
            large = np.zeros((2, 1_000_000))
            assert call("run", False, (large, 0.5), results=2) == (2_000_000, 0)
            assert large[1, 0] == 3.0**0.5
            assert not np.delete(large.ravel(), 1_000_000).any()
        with pytest.raises(RuntimeError, match=r"run\.1\.0: expected an array f2"):
            node.call("run", True, (np.zeros(3), 2.0), results=2)


@contextmanager
def computed_by(kernel: Kernel, call: Callable[..., Any]) -> Iterator[None]:
    """Compute all requested results of a kernel in a WebAssembly host."""
    own = {name: kernel.__dict__.pop(name) for name in ENTRIES if name in kernel.__dict__}
    for name in ENTRIES:
        kernel.__dict__[name] = lambda *arguments, name=name: call(name, *arguments)
    try:
        yield
    finally:
        for name in ENTRIES:
            del kernel.__dict__[name]
        kernel.__dict__.update(own)


def problem_of(name: str) -> tuple[Problem, float]:
    """A shipped hammer under five pulses, a textbook oscillator under a sinusoidal force; the end time."""
    hammer = ph.load(name)
    at = hammer.position or 0.0
    if hammer.waveform is not None:
        period = 5.0 * hammer.waveform.width
        train = ph.PulseTrain(hammer.waveform, period=period, pulses=5)
        # Near the kinks of contacts, and with a circuit, the error of integration depends on the steps, which
        # rounding changes.
        is_driven = hammer.waveform.quantity == "voltage"
        has_kinks = is_driven or any(key.startswith("contact.") for key in hammer.terms)
        tolerance = 1e-13 if has_kinks else 2e-11
        return Problem(hammer, train, (at, 0.0), 0.0, tolerance), 5.0 * period
    # A ball of a gram, or a mass and a stiffness of 1.
    is_ball = hammer.mass < 0.5
    height, sine = (1e-3, ("5 mN", 60.0)) if is_ball else (0.4, ("0.3 N", 0.13))
    start = (at + height, 0.0)
    return Problem(hammer, ph.SineForce(*sine), start, 0.0, 2e-11), 0.2 if is_ball else 40.0


def states(problem: Problem, end: float, times: FloatArray) -> tuple[FloatArray, Record]:
    """Displacement and velocity, and the record."""
    record = problem.run(end)
    return problem.resample(record, times)[:, :2], record


def assert_close(found: FloatArray, expected: FloatArray) -> None:
    """Check agreement to 1e-12 of the range of each column; a contact at the end has no velocity out."""
    for column, right in zip(found.T, expected.T, strict=True):
        size = np.nanmax(np.abs(right), initial=1e-300)
        np.testing.assert_allclose(column, right, rtol=0.0, atol=1e-12 * size)


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped())
def test_a_module_computes_what_machine_code_computes(name: str, tmp_path: Path) -> None:
    problem, end = problem_of(name)
    path = tmp_path / "kernel.wasm"
    path.write_bytes(page_module(problem.kernel.laws).content())
    host = Wasmtime(path.read_bytes())
    assert host.imports == []
    times = np.linspace(0.0, end, 401)
    machine, record = states(problem, end, times)
    scales = np.ptp(machine, axis=0)
    # Where a mass that differs by rounding leads elsewhere, machine code and module may differ too.
    apart = np.zeros(len(times), dtype=bool)
    for nudge in (5e-16, -5e-16):
        other_problem, _ = problem_of(name)
        other_problem.constants[INVERSE_MASS] *= 1.0 + nudge
        other, _ = states(other_problem, end, times)
        apart |= (np.abs(other - machine) > 5e-13 * scales).any(axis=1)
    known = int(np.argmax(apart)) if apart.any() else len(times)
    assert known > 40
    with Node(path) as node:
        found = []
        for call in (host.call, node.call):
            with computed_by(problem.kernel, call):
                found.append(states(problem, end, times))
    (web, web_record), (in_node, node_record) = found
    np.testing.assert_array_equal(in_node, web)
    np.testing.assert_array_equal(node_record.contacts, web_record.contacts)
    np.testing.assert_allclose(web[:known] / scales, machine[:known] / scales, rtol=0.0, atol=1e-12)
    over = [int((each.contacts[:, 3] < times[known - 1]).sum()) for each in (record, web_record)]
    assert over[0] == over[1]
    # Surface, time and velocity in, velocity out.
    begun, web_begun = (each.contacts[: over[0], [0, 1, 2, 4]] for each in (record, web_record))
    assert_close(web_begun, begun)
    # Where the armature leaves from rest, and at a maximum, a curve is flat: the time is known to the square
    # root of what the curve is known to.
    flat = {"rtol": 0.0, "atol": 1e-8 * end}
    np.testing.assert_allclose(web_record.contacts[: over[0], 3], record.contacts[: over[0], 3], **flat)
    # What is computed from one record has no horizon.
    steps = np.arange(len(record.nodes) - 1)

    def from_record() -> list[FloatArray]:
        ends = np.ascontiguousarray(record.nodes[:, 0])
        energies = problem.quadratures(record, steps, ends[:-1], ends[1:])
        return [problem.resample(record, times), problem.peaks(record), energies]

    expected = from_record()
    with computed_by(problem.kernel, host.call):
        curves, peaks, energies = from_record()
    assert_close(curves, expected[0])
    assert_close(peaks[:, 1:], expected[1][:, 1:])
    np.testing.assert_allclose(peaks[:, 0], expected[1][:, 0], **flat)
    assert_close(energies, expected[2])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hendriks-1983-1", "relay-5v"])
def test_a_module_computes_many_runs(name: str, tmp_path: Path) -> None:
    hammer = ph.load(name)
    assert hammer.waveform is not None
    width = hammer.waveform.width
    drives = [ph.PulseTrain(hammer.waveform, period=period * width, pulses=2) for period in (4.0, 5.0, 6.0)]
    # Rounding decides how a step ends on a kink of the contacts: the error of integration must be smaller.
    ensemble = ph.Ensemble(hammer, drives, 11.0 * width, tolerance=1e-13)
    (group,) = ensemble.groups

    def computed() -> ph.EnsembleResult:
        times = np.linspace(0.0, 11.0 * width, 50)
        return ensemble.run(dots=True, strobes="firings", times=times, engine="plain", threads=1)

    machine = computed()
    path = tmp_path / "kernel.wasm"
    path.write_bytes(page_module(group.kernel.laws).content())
    host = Wasmtime(path.read_bytes())
    with Node(path) as node:
        for call in (host.call, node.call):
            with computed_by(group.kernel, call):
                web = computed()
            np.testing.assert_array_equal(web.status, machine.status)
            np.testing.assert_allclose(web.x, machine.x, rtol=0.0, atol=1e-6 * np.ptp(machine.x))
            assert web.strobes is not None
            assert machine.strobes is not None
            for found, expected in ((web.strobes.x, machine.strobes.x), (web.strobes.v, machine.strobes.v)):
                np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-11 * np.ptp(expected))
            for column in ("flight_time", "impact_speed", "peak_force"):
                found, expected = getattr(web.dots, column), getattr(machine.dots, column)
                np.testing.assert_allclose(found, expected, rtol=1e-11)
