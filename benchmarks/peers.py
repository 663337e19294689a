"""Printhammer against general-purpose solvers: one table, one run, one problem, the error of each measured.

    python benchmarks/peers.py [--quick] [--json FILE] [--markdown FILE] [--threads N]

The same as `printhammer bench`. Peers that are not installed are left out and named. To have them without
touching the locked environment of the repository, give them one of their own:

    python3 -m venv build/peers-venv
    build/peers-venv/bin/python -m pip install --requirement benchmarks/requirements-peers.txt --editable .
    build/peers-venv/bin/python benchmarks/peers.py
    make bench PEERS=build/peers-venv/bin     (the same, into docs/benchmarks.md)

Boost.Odeint and SUNDIALS are compiled on the spot from `src/printhammer/bench/cpp` where a C++ compiler finds
their headers (Debian: libboost-dev, libsundials-dev).
"""

from __future__ import annotations

import sys

from printhammer.cli.main import main

if __name__ == "__main__":
    main(["bench", *sys.argv[1:]])
