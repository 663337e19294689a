"""The kernel against the reference for combinations of parts and kinds of drives.

Few combinations are worth the time to compile them: the fast tests and the combinations run the same source
as plain Python, the tests on traps and oracles run machine code, and the slow tests both.
"""

import functools
import itertools
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tests import hammers
from tests.hammers import BACKSTOPS, PACKS, SPRINGS, STOP, compare, drives, interpreted, made_of, preload

import printhammer as ph
from printhammer.run import problem

DURATION = 2.4e-3
PAIRS = [pair for pair in itertools.product(PACKS, BACKSTOPS) if pair != ("", "")]


@pytest.fixture(autouse=True)
def _few_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(problem, "MAX_STEPS", 100_000)


@functools.cache
def table(folder: Path) -> dict[str, str]:
    return hammers.magnet_table(folder)


def hammer_of(magnet: str, spring: str, pack: str, backstop: str, folder: Path) -> ph.Hammer:
    chosen = table(folder) if magnet == "table" else hammers.MAGNETS[magnet]
    return made_of(magnet=chosen, spring=SPRINGS[spring], pack=PACKS[pack], backstop=BACKSTOPS[backstop])


def check(hammer: ph.Hammer, drive: ph.PulseTrain | ph.SineForce) -> None:
    """Compare motion, touches and ledger from a moving start beyond the backstop, which all hammers allow."""
    state = STOP + 20e-6, -0.4
    found = compare(hammer, drive, DURATION, state=state, sensitive=True)
    motion, truth = found.motion, found.truth
    if motion.status == "runaway":
        # The reference has no such limit.
        assert truth.status == "ok"
    elif found.horizon == DURATION:
        assert motion.status == truth.status
    tabulated = hammer.magnet is not None and hammer.magnet.law == "table"
    # The knots of a table are no switches.
    assert found.error < (5e-8 if tabulated else 1e-8)
    for surface in ("pack", "backstop"):
        mine, theirs = found.touches(surface)
        assert len(mine) == len(theirs)
    fastest = float(np.abs(motion.v).max())
    size = max(motion.energy.throughput, 0.5 * hammer.mass * fastest**2)
    if motion.ok:
        assert abs(motion.energy.residual) < (1e-7 if tabulated else 1e-8) * size


def kind_of(magnet: str) -> str:
    return "current" if magnet else "force"


# A chequerboard: each pack with half of the backstops, each backstop with half of the packs.
QUICK = [(p, b) for p, b in PAIRS if (list(PACKS).index(p) + list(BACKSTOPS).index(b)) % 2 == 0]


@pytest.mark.parametrize(("pack", "backstop"), QUICK, ids=lambda name: name or "none")
def test_pairs_of_contacts(pack: str, backstop: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    """The other parts and the drives in turn; the slow test covers every pair."""
    turn = QUICK.index((pack, backstop))
    magnet = ["inverse-root", "", "table"][turn % 3]
    spring = list(SPRINGS)[turn % 2]
    hammer = hammer_of(magnet, spring, pack, backstop, tmp_path_factory.getbasetemp())
    chosen = list(drives(kind_of(magnet)).values())
    with interpreted():
        check(hammer, chosen[turn % len(chosen)])


def test_the_pairs_meet_every_drive() -> None:
    names = set()
    for turn in range(len(QUICK)):
        kind = kind_of(["inverse-root", "", "table"][turn % 3])
        chosen = list(drives(kind))
        names.add(chosen[turn % len(chosen)])
    assert names == set(drives("force"))


@pytest.mark.parametrize("drive", drives("current"))
def test_every_current_drives_the_shipped_hammer(drive: str) -> None:
    check(hammers.crude(), drives("current")[drive])


@pytest.mark.parametrize("drive", drives("force"))
def test_every_force_drives_a_hammer_without_magnet(drive: str) -> None:
    check(hammers.shelf(-4.0), drives("force")[drive])


MAGNETS = ["inverse-root", "table", ""]
ALL = list(itertools.product(MAGNETS, SPRINGS, PACKS, BACKSTOPS))


def combinations() -> Iterator[tuple[str, str, str, str]]:
    """Yield every triple of magnet, pack and backstop, each with a spring, so that every pair of parts meets.

    Forces of springs are added; the events of a run, and the order of its sections, are those of the others.
    """
    for magnet, pack, backstop in itertools.product(MAGNETS, PACKS, BACKSTOPS):
        turn = MAGNETS.index(magnet) + list(PACKS).index(pack) + list(BACKSTOPS).index(backstop)
        yield magnet, list(SPRINGS)[turn % len(SPRINGS)], pack, backstop


def test_every_pair_of_parts_meets() -> None:
    for one, other in itertools.combinations(range(4), 2):
        kinds = [[MAGNETS, SPRINGS, PACKS, BACKSTOPS][k] for k in (one, other)]
        assert {(parts[one], parts[other]) for parts in combinations()} == set(itertools.product(*kinds))


@pytest.mark.slow
@pytest.mark.parametrize("magnet", MAGNETS, ids=lambda name: name or "none")
@pytest.mark.parametrize("pack", PACKS, ids=lambda name: name or "none")
def test_combinations_of_parts(magnet: str, pack: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.getbasetemp()
    chosen = list(drives(kind_of(magnet)).values())
    for parts in combinations():
        if (parts[0], parts[2]) == (magnet, pack):
            turn = ALL.index(parts)
            with interpreted():
                check(hammer_of(*parts, folder), chosen[turn % len(chosen)])


COMPILED = [
    ("inverse-root", "linear", "power", "hertz"),
    ("inverse-root", "linear", "curve", "hertz-no-pull"),
    ("", "preload", "power", "rigid"),
    ("", "preload", "dashpot", "elastomer"),
    ("", "preload", "dashpot-pull", "elastomer-pull"),
    ("table", "linear", "dashpot", "rigid"),
]


@pytest.mark.slow
@pytest.mark.parametrize("parts", COMPILED, ids="-".join)
def test_every_drive_on_compiled_combinations(
    parts: tuple[str, str, str, str], tmp_path_factory: pytest.TempPathFactory
) -> None:
    hammer = hammer_of(*parts, tmp_path_factory.getbasetemp())
    for drive in drives(kind_of(parts[0])).values():
        check(hammer, drive)


def test_machine_code_and_plain_python_agree() -> None:
    """The contraction of multiply and add is the only freedom of the compiler."""
    hammer = hammers.crude()
    drive = ph.PulseTrain(hammer.waveform)
    times = np.linspace(0.0, 2e-3, 201)
    compiled = ph.simulate(hammer, drive, times=times)
    with interpreted():
        plain = ph.simulate(hammer, drive, times=times)
        np.testing.assert_allclose(plain.x, compiled.x, rtol=0.0, atol=1e-9 * hammers.STROKE)
        assert len(plain.contacts) == len(compiled.contacts)
    assert abs(plain.steps - compiled.steps) <= 2


@pytest.mark.parametrize("front", [-203.2e-6, 0.0, 203.2e-6])
@pytest.mark.parametrize("pack", ["power", "dashpot"])
def test_a_pack_lies_anywhere_without_a_backstop(pack: str, front: float) -> None:
    """Before and behind a spring of negative stiffness, which pushes the armature into it."""
    part = PACKS[pack]
    assert part is not None
    hammer = made_of(spring=preload(0.5, -2e4), pack=part.model_copy(update={"front": front}))
    drive = drives("force")["train"]
    with interpreted():
        found = compare(hammer, drive, 1.0e-3, state=(front - 20e-6, 1.0), sensitive=True)
    assert found.motion.ok
    assert found.error < 1e-8
    mine, theirs = found.touches("pack")
    assert len(mine) == len(theirs) > 0
