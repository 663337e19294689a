"""The entry point of the fits: constants taken from the hammer, and invalid input."""

from pathlib import Path

import pytest
from tests import measurements as lab
from tests.errors import refused
from tests.measurements import write

import printhammer as ph


def test_what_the_hammer_knows(tmp_path: Path, hammer: ph.Hammer) -> None:
    forces, alone = write(tmp_path / "m.csv", lab.magnet()), write(tmp_path / "s.csv", lab.spring())
    found = ph.fit("magnet", [alone, forces], hammer=hammer)
    assert found["magnet.F0"].value == pytest.approx(lab.F0, rel=1e-8)
    assert found.source == ("m.csv", "s.csv")
    assert ph.fit("spring", str(alone), hammer=hammer)["spring.Bs"].value == pytest.approx(lab.BS)
    given = ph.fit("spring", alone, position="0.002 in")
    assert given["spring.Bs"] == ph.fit("spring", alone, hammer=hammer)["spring.Bs"]
    columns, branch = lab.pack()
    cycles = write(tmp_path / "p.csv", columns, branch)
    for options in ({"hammer": hammer}, {"thickness": "0.007 in"}):
        fit = ph.fit("pack", cycles, **options)
        assert fit["pack.stiffness"].value == pytest.approx(lab.STIFFNESS)
    rebounds = write(tmp_path / "r.csv", lab.rebounds())
    k = hammer.constants["backstop.stiffness"].si
    damping = ph.fit("backstop", rebounds, hammer=hammer)["backstop.damping"]
    assert damping.value == pytest.approx(lab.RATIO * k)


def test_what_it_refuses(tmp_path: Path, hammer: ph.Hammer) -> None:
    forces = write(tmp_path / "m.csv", lab.magnet())
    with refused("kind"):
        ph.fit("wheel", forces)
    with refused("tables"):
        ph.fit("pack", [forces, forces], hammer=hammer)
    with refused("current"):
        ph.fit("magnet", [forces, forces], hammer=hammer)
    with refused("hammer"):
        ph.fit("motion", forces)
    with refused("position"):
        ph.fit("spring", forces, position="2 s")
    with refused("thickness"):
        ph.fit("pack", forces, hammer=hammer.replace("pack", None))
    with refused("thickness"):
        ph.fit("pack", forces, thickness=-1.0)
