"""Machine code that is wanted next, made by a second process while this one makes what is wanted first.

    python -m printhammer.run.ahead LAWS

compiles, for laws told as JSON, what a motion needs beside its run. It is found on disk afterwards; where it
is not, be it that the laws are those of a part file or that nothing can be kept, the first process makes it.
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
    """Have what a motion needs beside its run compiled by another process, if there is a core for it.

    Returns
    -------
    callable
        Waits for the process, which ends with this one at the latest.
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
    """Compile what a motion needs beside its run, by calls on a record of nothing."""
    kernel = specialise(laws)
    none, nodes, contacts, constants = np.empty(0), np.empty((0, 5)), np.empty((0, 7)), np.zeros(64)
    drive = (none, np.zeros(0, np.int64), np.empty((0, 7)), False, np.zeros(0, np.int64), np.zeros(1))
    kernel.peaks(contacts, nodes, drive, constants, np.empty((0, 3)))
    kernel.quadratures(np.zeros(0, np.int64), none, none, nodes, drive, constants, np.empty((0, 5)))
    kernel.resample(none, nodes, drive, constants, np.empty((0, 10)))


if __name__ == "__main__":
    prepare(Laws(**json.loads(sys.argv[1])))
