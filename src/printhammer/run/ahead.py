"""Compile, in a second process, the machine code that evaluates a motion after its run.

    python -m printhammer.run.ahead LAWS

compiles these functions for laws passed as JSON; the first process then loads the machine code from disk. If
the second process cannot compile, because the laws come from a part file or the cache cannot be written, the
first process compiles the functions itself.
"""

from __future__ import annotations

import atexit
import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict

import numpy as np

from printhammer.kernel.compile.specialise import specialise
from printhammer.kernel.model.laws import Laws
from printhammer.support.threads import thread_count


def begin(laws: Laws) -> Callable[[], None]:
    """Start compiling the code that evaluates a finished run, in another process if a core is free.

    Returns
    -------
    callable
        Function that waits for the other process, which is terminated if this process ends first.
    """
    if thread_count(None) < 2:
        return _nothing
    process = subprocess.Popen(
        [sys.executable, "-m", __name__, json.dumps(asdict(laws))],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    atexit.register(process.terminate)

    def wait() -> None:
        process.wait()
        atexit.unregister(process.terminate)

    return wait


def _nothing() -> None:
    pass


def prepare(laws: Laws) -> None:
    """Compile the code that evaluates a finished run, by calling it with an empty record."""
    kernel = specialise(laws)
    none, nodes, contacts, constants = np.empty(0), np.empty((0, 5)), np.empty((0, 7)), np.zeros(64)
    drive = (none, np.zeros(0, np.int64), np.empty((0, 7)), False, np.zeros(0, np.int64), np.zeros(1))
    kernel.peaks(contacts, nodes, drive, constants, np.empty((0, 3)))
    kernel.quadratures(np.zeros(0, np.int64), none, none, nodes, drive, constants, np.empty((0, 5)))
    kernel.resample(none, nodes, drive, constants, np.empty((0, 10)))


if __name__ == "__main__":
    prepare(Laws(**json.loads(sys.argv[1])))
