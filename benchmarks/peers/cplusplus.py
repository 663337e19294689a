"""Boost.Odeint and SUNDIALS in C++, compiled if a compiler and the headers of the libraries are found."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import tempfile
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.solvers.entry import Absent, Entry
from benchmarks.solvers.problem import FIRST, GRID, PERIOD

from .equations import current_pieces, hammer_constants

if TYPE_CHECKING:
    from benchmarks.solvers.problem import Task
    from printhammer.support.arrays import FloatArray

_FLAGS = ("-std=c++17", "-O3", "-march=native", "-shared", "-fPIC")
_SUNDIALS = ("-lsundials_cvode", "-lsundials_nvecserial", "-lsundials_sunnonlinsolfixedpoint")
_NONE = np.zeros(0)


def odeint(task: Task, quick: bool) -> list[Entry]:
    """Return the benchmark entries of Boost.Odeint, one for each method and tolerance.

    Raises
    ------
    Absent
        There is no C++ compiler, or Boost's headers are not found.
    """
    library, version = _library("odeint.cpp", "boost/version.hpp", "BOOST_LIB_VERSION", ())
    name = f"Boost.Odeint {version.replace('_', '.')}"
    five, seven = "Dormand-Prince 5, located", "Fehlberg 7(8), located"
    settings = [(0, five, 1e-8), (0, five, 1e-10), (1, seven, 1e-8)]
    return [
        _entry(task, quick, f"{name}: {method}, {tolerance:.0e}", library, stepper, tolerance)
        for stepper, method, tolerance in settings
    ]


def sundials(task: Task, quick: bool) -> list[Entry]:
    """Return the benchmark entries of SUNDIALS, one for each tolerance.

    Raises
    ------
    Absent
        There is no C++ compiler, or the headers or libraries of SUNDIALS are not found.
    """
    library, version = _library("cvode.cpp", "sundials/sundials_config.h", "SUNDIALS_VERSION", _SUNDIALS)
    return [
        _entry(
            task,
            quick,
            f"SUNDIALS {version} CVODE Adams, its events, {tolerance:.0e}",
            library,
            0,
            tolerance,
        )
        for tolerance in (1e-10, 1e-12)
    ]


def _entry(task: Task, quick: bool, name: str, library: Any, stepper: int, tolerance: float) -> Entry:
    solve = partial(_solve, library, stepper, tolerance, task)
    pulses = 5 if quick else 50
    return Entry(name, lambda: solve(FIRST, GRID), lambda: solve(pulses * PERIOD, _NONE), pulses * PERIOD)


def _solve(
    library: Any, stepper: int, tolerance: float, task: Task, end: float, grid: FloatArray
) -> FloatArray:
    pieces = current_pieces(task, end)
    out = np.full(grid.size, np.nan)
    arrays = [array.ctypes.data_as(ctypes.c_void_p) for array in (hammer_constants(task), pieces, grid, out)]
    evaluations = library.solve(
        stepper,
        arrays[0],
        len(pieces),
        arrays[1],
        ctypes.c_double(task.rest),
        ctypes.c_double(tolerance),
        grid.size,
        *arrays[2:],
    )
    if evaluations < 0:
        raise RuntimeError("the solver gave up")
    return out


@lru_cache(maxsize=4)
def _library(source: str, header: str, version_macro: str, libraries: tuple[str, ...]) -> tuple[Any, str]:
    compiler = os.environ.get("CXX") or shutil.which("c++") or shutil.which("g++") or shutil.which("clang++")
    if not compiler:
        raise Absent("no C++ compiler")
    probe = subprocess.run(
        [compiler, "-E", "-dM", "-x", "c++", "-include", header, os.devnull],
        capture_output=True,
        text=True,
        check=False,
    )
    if probe.returncode:
        raise Absent(f"header {header} not found")
    version = next(
        (
            line.split(maxsplit=2)[2].strip('"')
            for line in probe.stdout.splitlines()
            if f" {version_macro} " in line
        ),
        "",
    )
    folder = Path(tempfile.mkdtemp(prefix="printhammer-bench-"))
    try:
        target = folder / "peer.so"
        built = subprocess.run(
            [compiler, *_FLAGS, str(Path(__file__).parent / "cpp" / source), "-o", str(target), *libraries],
            capture_output=True,
            text=True,
            check=False,
        )
        if built.returncode:
            last = (built.stderr.strip().splitlines() or ["no message"])[-1]
            raise Absent(f"{source} does not build: {last}")
        library = ctypes.CDLL(str(target))
    finally:
        shutil.rmtree(folder)
    library.solve.restype = ctypes.c_long
    library.solve.argtypes = [
        ctypes.c_long,
        ctypes.c_void_p,
        ctypes.c_long,
        ctypes.c_void_p,
        *(ctypes.c_double, ctypes.c_double),
        ctypes.c_long,
        *(ctypes.c_void_p, ctypes.c_void_p),
    ]
    return library, version
