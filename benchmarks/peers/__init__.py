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
How the peers are used (`benchmarks/peers`): everyone has a compiled right-hand side, one for each mode, is
stopped at every switch and edge of the drive, and starts anew there; "one right-hand side" is the same
problem as one would first write it. heyoka gets the equations in variables in which they are analytic,
since a Taylor method needs that; all its switches happen in event callbacks, which are Python, and a lane
that is done takes the next member. diffrax is one compiled loop under `jax.vmap`. Boost.Odeint and SUNDIALS
are C++, compiled with `-O3 -march=native`; Odeint has no events, so a switch is located by repeating the
step with a length found by Newton's method."""
"""What the page of the documentation says about them."""
