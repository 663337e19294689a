"""Solvers of the table: how each is asked for its motion and timed, and where peers come from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from benchmarks.solvers.problem import Task
    from printhammer.support.arrays import FloatArray

Say = Callable[[str], None]
"""Called with a line before each step."""


class Absent(Exception):
    """A peer that is not installed here, or does not work here; the message says why."""


@dataclass
class Entry:
    """One solver with one setting."""

    name: str
    """Solver, method and tolerance."""
    positions: Callable[[], FloatArray]
    """Returns the displacement, m: of a single run at `benchmarks.solvers.problem.GRID`; of the members of an
    ensemble that are compared at `benchmarks.solvers.problem.ENDS`. The first call may compile."""
    integrate: Callable[[], object]
    """Does what is timed, without output."""
    duration: float
    """Hammer-seconds of what is timed, over all members."""
    members: int = 1
    """1 for a single run; the number of runs of an ensemble."""
    ours: bool = False
    """Whether it is this program."""


SingleMaker = Callable[["Task", bool], list[Entry]]
"""Makes a peer's entries from the problem and whether runs are short; raises `Absent`."""
EnsembleMaker = Callable[["Task", bool, int], list[Entry]]
"""The same for ensembles of so many members."""


@dataclass(frozen=True)
class Peers:
    """Solvers of others, by name, and what the page says about how they are used."""

    single: dict[str, SingleMaker] = field(default_factory=dict)
    ensembles: dict[str, EnsembleMaker] = field(default_factory=dict)
    used: str = ""


def load_peers(folder: Path) -> Peers:
    """Import a folder of peers: a package whose `SINGLE`, `ENSEMBLES` and `USED` become those of `Peers`.

    Raises
    ------
    InputError
        The folder is no such package.
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
