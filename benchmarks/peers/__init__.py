"""General-purpose solvers applied to the benchmark, for `benchmarks.solvers --peers benchmarks/peers`.

Solvers that are not installed are listed but not measured. To install them without changing the locked
environment of the repository, create a separate environment:

    python3 -m venv build/peers-venv
    build/peers-venv/bin/python -m pip install --requirement benchmarks/peers/requirements.txt --editable .
    build/peers-venv/bin/python -m benchmarks.solvers --peers benchmarks/peers
    make bench PEERS=build/peers-venv/bin     (the same, into docs/benchmarks.md)

Boost.Odeint and SUNDIALS are compiled from the folder `cpp` if a C++ compiler finds their headers (Debian:
libboost-dev, libsundials-dev). A solver receives the problem from `benchmarks.solvers.problem` and returns
`benchmarks.solvers.entry.Entry` objects, or raises `Absent`.
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
"""Other solvers that integrate one run at a time, by name."""

ENSEMBLES: Final[dict[str, EnsembleMaker]] = {"heyoka": heyoka.ensembles, "diffrax": diffrax.entries}
"""Other solvers that integrate ensembles, by name."""

USED: Final = """\
The other solvers are used as follows (`benchmarks/peers`). Every solver has a compiled right-hand side
for each mode, stops at every switch and at every edge of the drive, and restarts at these instants. A
solver marked "one right-hand side" evaluates all modes in a single function, which is the
straightforward formulation. For heyoka, the equations are written in variables in which they are
analytic, as a Taylor method requires. heyoka handles switches in event callbacks in Python, and a
vector lane that has finished one member continues with the next member. diffrax is a single compiled
loop under `jax.vmap`. Boost.Odeint and SUNDIALS are C++ libraries, compiled with `-O3 -march=native`;
Odeint has no events, so a switch is located by repeating the step with a length computed by Newton's
method."""
"""Text of the documentation page about the use of the other solvers."""
