"""Entries of the table of solvers: functions that compute and time a run, and the import of other solvers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from benchmarks.solvers.problem import Task
    from printhammer.support.arrays import FloatArray

Say = Callable[[str], None]
"""Callback that receives a line of text before each step."""


class Absent(Exception):
    """Raised for a solver that is not installed or does not work; the message states the reason."""


@dataclass
class Entry:
    """Entry of the table of solvers: one solver with one method and tolerance."""

    name: str
    """Solver, method and tolerance."""
    positions: Callable[[], FloatArray]
    """Function that returns displacements, m: of a single run at `benchmarks.solvers.problem.GRID`; of the
    checked members of an ensemble at `benchmarks.solvers.problem.ENDS`. The first call may compile."""
    integrate: Callable[[], object]
    """Function that is timed: the integration without output."""
    duration: float
    """Hammer-seconds of the timed integration, summed over all members."""
    members: int = 1
    """Number of runs: 1 for a single run, the number of members for an ensemble."""
    ours: bool = False
    """Whether the solver is printhammer."""


SingleMaker = Callable[["Task", bool], list[Entry]]
"""Function that builds a solver's entries from the problem and the flag `quick`; raises `Absent`."""
EnsembleMaker = Callable[["Task", bool, int], list[Entry]]
"""Function that builds a solver's entries for ensembles with a number of members; raises `Absent`."""


@dataclass(frozen=True)
class Peers:
    """Other solvers, by name, and the text of the documentation page about their use."""

    single: dict[str, SingleMaker] = field(default_factory=dict)
    ensembles: dict[str, EnsembleMaker] = field(default_factory=dict)
    used: str = ""


def load_peers(folder: Path) -> Peers:
    """Import a folder of solvers: a package with `SINGLE`, `ENSEMBLES` and `USED`, the fields of `Peers`.

    Raises
    ------
    InputError
        The folder is not such a package.
    """
    import importlib.util
    import sys

    from printhammer.errors import InputError

    start, name = folder / "__init__.py", "printhammer_peers"
    spec = importlib.util.spec_from_file_location(name, start, submodule_search_locations=[str(folder)])
    if not start.is_file() or spec is None or spec.loader is None:
        raise InputError(
            f"peers = {folder}: expected a folder of solvers with __init__.py", key="peers", value=folder
        )
    for old in [key for key in sys.modules if key.partition(".")[0] == name]:
        del sys.modules[old]
    package = sys.modules[name] = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(package)
        return Peers(package.SINGLE, package.ENSEMBLES, package.USED)
    except (ImportError, AttributeError, SyntaxError) as error:
        raise InputError(
            f"peers = {folder}: expected a folder of solvers: {error}", key="peers", value=folder
        ) from error
