"""Fixtures and settings shared by all tests."""

import os
import signal
import subprocess
import sys

import pytest
from hypothesis import settings
from tests.hammers import CRUDE

import printhammer as ph

os.environ["MPLBACKEND"] = "Agg"

# A job in the background ignores Ctrl-C, and so would every program that a test starts and interrupts.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Compilation makes first examples slow; the same examples on every run make a failure somebody else's too.
settings.register_profile("ci", deadline=None, derandomize=True, print_blob=True)
settings.register_profile("explore", deadline=None, max_examples=1000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "ci"))


def pytest_configure(config: pytest.Config) -> None:
    """Compile what most tests need once, before workers of their own do it side by side."""
    if config.getoption("numprocesses", None) and not hasattr(config, "workerinput") and not compiled():
        subprocess.run([sys.executable, "-m", "printhammer", "warm", CRUDE], check=True, capture_output=True)


def compiled() -> bool:
    """Tell whether the machine code for the hammer of most tests is on disk."""
    from printhammer.kernel.compile.specialise import is_ready, specialise
    from printhammer.run.problem import laws_of

    hammer = ph.load(CRUDE)
    assert hammer.waveform is not None
    return is_ready(specialise(laws_of(hammer, ph.PulseTrain(hammer.waveform))).run)


@pytest.fixture(scope="session")
def hammer() -> "ph.Hammer":
    """A hammer that stays as it is; frozen, so that all tests can share it."""
    return ph.load(CRUDE)
