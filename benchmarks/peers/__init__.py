"""General-purpose solvers on the benchmark's problem, for `benchmarks.solvers --peers benchmarks/peers`.

Peers that are not installed are left out and named. To have them without touching the locked environment of
the repository, give them one of their own:

    python3 -m venv build/peers-venv
    build/peers-venv/bin/python -m pip install --requirement benchmarks/peers/requirements.txt --editable .
    build/peers-venv/bin/python -m benchmarks.solvers --peers benchmarks/peers
    make bench PEERS=build/peers-venv/bin     (the same, into docs/benchmarks.md)

Boost.Odeint and SUNDIALS are compiled on the spot from `cpp` where a C++ compiler finds their headers
(Debian: libboost-dev, libsundials-dev). A peer is told the problem by `benchmarks.solvers.problem` and
answers with `benchmarks.solvers.entry.Entry`, or raises `Absent`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from . import cplusplus, diffrax, heyoka, numbalsoda, scipy, sundae

if TYPE_CHECKING:
    from benchmarks.solvers.entry import EnsembleMaker, SingleMaker

SINGLE: Final[dict[str, SingleMaker]] = {
    "SciPy": scipy.entries,
    "numbalsoda": numbalsoda.entries,
    "heyoka": heyoka.entries,
    "Boost.Odeint": cplusplus.odeint,
    "SUNDIALS": cplusplus.sundials,
    "scikit-sundae": sundae.entries,
}
"""Peers that integrate one run at a time, by name."""

ENSEMBLES: Final[dict[str, EnsembleMaker]] = {"heyoka": heyoka.ensembles, "diffrax": diffrax.entries}
"""Peers with ensembles of their own, by name."""

USED: Final = """\
Use of the other solvers (`benchmarks/peers`): every solver has a compiled right-hand side for each mode,
stops at every switch and edge of the drive, and restarts there; "one right-hand side" means that all
modes are in a single function, the straightforward formulation. For heyoka, the equations are written in
variables in which they are analytic, as a Taylor method requires; its switches are handled in event
callbacks in Python, and a lane that is done continues with the next member. diffrax is a single compiled
loop under `jax.vmap`. Boost.Odeint and SUNDIALS are C++ libraries, compiled with `-O3 -march=native`;
Odeint has no events, so a switch is located by repeating the step with a length computed by Newton's
method."""
"""Text of the documentation page about the use of the other solvers."""
