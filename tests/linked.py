"""The kernel linked from modules against the kernel that is lowered together with its laws.

`python -m tests.linked 50` compares random combinations of shipped laws, and prints the largest differences.
"""

import itertools
import sys
from dataclasses import dataclass

import numpy as np
from tests.hammers import BACKSTOPS, MAGNETS, PACKS, SPRINGS, STOP, drives, made_of

import printhammer as ph
from printhammer.kernel.compile import calls, link, lower
from printhammer.kernel.compile.bindings import bindings_of
from printhammer.kernel.compile.compiling import compiled
from printhammer.kernel.compile.signatures import RESULTS, signature_of
from printhammer.kernel.compile.templates import TEMPLATES, compile_law, execute_all
from printhammer.parts.damping import ViscousDamping
from printhammer.run.problem import Problem, Record

COMBINATIONS = list(itertools.product(MAGNETS, SPRINGS, PACKS, BACKSTOPS, (False, True)))


@dataclass
class Both:
    """Records of the linked kernel and of the kernel lowered with its laws."""

    linked: Record
    whole: Record

    @property
    def equal(self) -> bool:
        """Whether all nodes and contacts have the same bits."""
        pairs = (self.linked.nodes, self.whole.nodes), (self.linked.contacts, self.whole.contacts)
        return all(mine.tobytes() == theirs.tobytes() for mine, theirs in pairs)

    @property
    def error(self) -> float:
        """Largest difference in a column of nodes or contacts, as a fraction of the column's maximum."""
        pairs = (self.linked.nodes, self.whole.nodes), (self.linked.contacts, self.whole.contacts)
        # The end of a contact that the run leaves open is NaN.
        if any(np.isnan(mine).tolist() != np.isnan(theirs).tolist() for mine, theirs in pairs):
            return np.inf
        pairs = tuple((np.nan_to_num(mine), np.nan_to_num(theirs)) for mine, theirs in pairs)
        columns = [pair for mine, theirs in pairs for pair in zip(mine.T, theirs.T, strict=True)]
        return max(float(np.abs(a - b).max(initial=0.0) / np.abs(b).max(initial=1e-300)) for a, b in columns)


def both(problem: Problem, end: float) -> Both:
    """Run a problem with both kernels."""
    bindings = bindings_of(problem.laws)
    bound = {law: compile_law(function, compiled) for law, function in bindings.names.items()}
    signature = signature_of("run", {})
    run = execute_all(TEMPLATES, {**bound, **bindings.choices}, f"bound_{id(problem):x}")["run"]
    library, symbol, _ = lower._lowered(run, tuple(lower._types(each) for each in signature))
    whole = library.with_callees(symbol, link.ENTRY).as_bitcode()
    calling = calls.calling_code(link.ENTRY, signature, link.CALL)
    address = link.load(link.emit(link.link(whole, [], {}, calling)))
    linked = problem.run(end)
    problem.kernel.__dict__["run"] = calls.caller(address, signature, RESULTS["run"])
    try:
        return Both(linked, problem.run(end))
    finally:
        del problem.kernel.__dict__["run"]


def of_shipped(name: str) -> Both:
    """Run five pulses of a shipped hammer with both kernels."""
    hammer = ph.load(name)
    drive = ph.PulseTrain(hammer.waveform, rate=0.2 / hammer.waveform.width, pulses=5)
    problem = Problem(hammer, drive, (hammer.position or 0.0, 0.0), 0.0, 1e-9)
    return both(problem, float(drive.times[-1]) + hammer.waveform.width)


def sample(count: int) -> list[tuple[str, str, str, str, bool]]:
    """Draw combinations of magnet, spring, pack, backstop and damping, without replacement."""
    order = np.random.default_rng(35).permutation(len(COMBINATIONS))
    return [COMBINATIONS[place] for place in order[:count]]


def of_combination(magnet: str, spring: str, pack: str, backstop: str, damped: bool) -> Both:
    """Run three pulses of a combination of laws with both kernels."""
    hammer = made_of(
        magnet=MAGNETS[magnet],
        spring=SPRINGS[spring],
        pack=PACKS[pack],
        backstop=BACKSTOPS[backstop],
        damping=ViscousDamping(coefficient=0.02) if damped else None,
    )
    drive = drives("current" if magnet else "force")["train"]
    return both(Problem(hammer, drive, (STOP + 20e-6, -0.4), 0.0, 1e-9), 2.4e-3)


if __name__ == "__main__":
    found = []
    for names in sample(int(sys.argv[1])):
        found.append(of_combination(*names))
        print(*names, found[-1].linked.steps, found[-1].equal, found[-1].error, flush=True)
    print(
        sum(each.equal for each in found), "of", len(found), "equal; error", max(each.error for each in found)
    )
