"""Fixtures and settings shared by all tests."""

import gc
import os
import signal
import subprocess
import sys
from collections import Counter
from time import perf_counter

import pytest
from hypothesis import settings
from tests.hammers import CRUDE

import printhammer as ph
from printhammer.run.simulate import watch_compiling

os.environ["MPLBACKEND"] = "Agg"

# A job in the background ignores Ctrl-C, and so would every program that a test starts and interrupts.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Compilation makes first examples slow; the same examples on every run make a failure somebody else's too.
settings.register_profile("ci", deadline=None, derandomize=True, print_blob=True)
settings.register_profile("explore", deadline=None, max_examples=1000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "ci"))


# Long files, and those that compile laws of their own, begin first: the workers then end together. Two that
# compile the same laws stand far apart, so that the second one finds the machine code.
FIRST = [
    "test_units",
    "test_recovery",
    "test_states",
    "test_learn",
    "test_circuit",
    "test_orbits",
    "test_registry",
    "test_results",
    "test_continuation",
    "test_strobe",
    "test_kill",
    "test_program",
    "test_motion",
    "test_examples",
    "test_docs",
    "test_page_commands",
    "test_docs_commands",
    "test_paper",
    "test_fits",
    "test_lists_reference",
    "test_family_shipped",
    "test_comparison",
    "test_conclusions",
    "test_cluster",
    "test_agreement",
    "test_ensemble",
    "test_orbits_closed_forms",
    "test_coil",
    "test_known_results",
    "test_continuation_impacts",
    "test_impact_print_hammer",
    "test_circuit_tangent",
    "test_axes",
    "test_tangent_finite_differences",
    "test_sequence_reference",
    "test_circuit_constants",
    "test_kernel_parts",
    "test_constant_flow_differences",
    "test_schemes_1983",
    "test_lanes",
]


# Six thousand tests and the compiler are a heap that the garbage collector would search over and over: a
# quarter of the time.
gc.set_threshold(50_000, 20, 20)


def pytest_collection_finish() -> None:
    """Freeze permanent objects, so that the garbage collector skips them."""
    gc.freeze()


class Compiling:
    """Count the entry points that are compiled in this process, and the time spent on them.

    Attributes
    ----------
    functions : int
        Number of compiled entry points of the kernel.
    seconds : float
        Wall-clock time of the compilations, s.
    """

    def __init__(self) -> None:
        self.functions, self.seconds = 0, 0.0
        self._begun = 0.0

    def __call__(self, begins: bool) -> None:
        """Start the clock when a compilation begins, stop it when it ends."""
        if begins:
            self._begun = perf_counter()
        else:
            self.functions += 1
            self.seconds += perf_counter() - self._begun


COMPILING = Compiling()
"""Compilations of this process; those of the workers are added to it as they end."""


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Send the count of compilations from a worker to the process that reports it."""
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["compiling"] = COMPILING.functions, COMPILING.seconds


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: object) -> None:
    """Add the compilations of a worker that has ended."""
    functions, seconds = getattr(node, "workeroutput", {}).get("compiling", (0, 0.0))
    COMPILING.functions += functions
    COMPILING.seconds += seconds


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Report the share of compilation, without programs that tests start."""
    if COMPILING.functions:
        text = (
            f"compiled {COMPILING.functions} functions in {COMPILING.seconds:.0f} s, summed over the workers"
        )
        terminalreporter.write_line(text)


def pytest_configure(config: pytest.Config) -> None:
    """Compile the code of most tests while workers collect tests; a worker waits for code it needs."""
    watch_compiling(COMPILING)
    if hasattr(config.option, "loadscopereorder"):
        config.option.loadscopereorder = False
    if config.getoption("numprocesses", None) and not hasattr(config, "workerinput") and not compiled():
        command = [sys.executable, "-m", "printhammer", "warm", CRUDE]
        warm = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)

        def end() -> None:
            _, said = warm.communicate()
            if warm.returncode:
                raise RuntimeError(said.decode())

        config.add_cleanup(end)


@pytest.hookimpl(tryfirst=True)
def pytest_itemcollected(item: pytest.Item) -> None:
    """Mark the tests of hypothesis as property tests."""
    if hasattr(getattr(item, "function", None), "hypothesis"):
        item.add_marker(pytest.mark.property)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the files in order: the files named above, then the files with the most tests."""
    count = Counter(item.path for item in items)
    rank = {name: place for place, name in enumerate(FIRST)}
    items.sort(key=lambda item: (rank.get(item.path.stem, len(FIRST)), -count[item.path]))


def compiled() -> bool:
    """Whether the machine code for the hammer of most tests is on disk."""
    from printhammer.kernel.compile.specialise import specialise
    from printhammer.run.problem import laws_of

    hammer = ph.load(CRUDE)
    assert hammer.waveform is not None
    return specialise(laws_of(hammer, ph.PulseTrain(hammer.waveform))).is_ready("run")


@pytest.fixture(scope="session")
def hammer() -> "ph.Hammer":
    """Return an immutable hammer, which all tests can share."""
    return ph.load(CRUDE)
