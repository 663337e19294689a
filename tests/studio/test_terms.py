"""The page's sums of products against the numbers of spring and damping, for every force and contact."""

import math
from itertools import chain
from typing import Any

import pytest

import printhammer as ph
from printhammer.parts.spring.terms import TERMS
from printhammer.studio.terms import sums_of

ENTRIES: dict[str, dict[str, Any]] = {
    "force.constant": {"force": -0.3},
    "force.gravity": {"angle": "35 deg", "acceleration": 9.7},
    "force.spring": {"position": 0.2e-3, "preload": 0.1, "stiffness": 300.0},
    "force.cubic": {"center": 0.1e-3, "stiffness": 150.0, "cubic": 4e8},
    "force.friction": {"kinetic": 0.2, "static": 0.3},
    "contact.linear": {"side": "front", "position": 0.3e-3, "stiffness": 2e3},
    "contact.hertz": {"side": "front", "position": 0.4e-3, "stiffness": 1e5, "damping": 0.4},
}
SPRINGS: dict[str, dict[str, Any]] = {
    "linear": {"As": 2e-3, "Bs": 0.5},
    "preload": {"preload": -0.5, "stiffness": 100.0},
    "cubic": {"center": 0.0, "stiffness": 120.0, "cubic": 3e8},
}


def evaluated(sums: list[Any], moved: ph.Hammer) -> dict[int, float]:
    """Numbers of a part that the page computes from the constants of a changed hammer, by index."""

    def value(key: str) -> float:
        return moved.constants[key].si

    def product(factor: float, up: list[str], down: list[str], sines: list[str]) -> float:
        over = math.prod(map(value, up)) / math.prod(map(value, down))
        return factor * over * math.prod(math.sin(value(key)) for key in sines)

    return {index: sum(product(*each) for each in products) for index, products in sums}


@pytest.mark.parametrize("spring", SPRINGS)
def test_every_force_and_contact(spring: str) -> None:
    known = {f"{section}.{law}" for section, laws in TERMS.items() for law in laws}
    assert known - set(ENTRIES) == {"force.sampled"}
    entries = {
        f"{key.partition('.')[0]}.{key.replace('.', '-')}": {"law": key.partition(".")[2], **constants}
        for key, constants in ENTRIES.items()
    }
    more = {"law": "friction", "kinetic": 0.05}
    parts = {"spring": {"law": spring, **SPRINGS[spring]}, "force.rod": more, **entries}
    parts["damping"] = {"law": "viscous", "coefficient": 0.4}
    hammer = ph.Hammer.build(1.3e-3).replace(parts)
    shown = {key for key in hammer.constants if key.partition(".")[0] in ("spring", "damping", *TERMS)}
    taken = {
        key
        for sums in sums_of(hammer).values()
        for _index, products in sums
        for _factor, *groups in products
        for key in chain(*groups)
    }
    # The page computes the acceleration of gravity as a constant only if the file states it.
    assert shown <= taken
    for key in sorted(taken):
        # Static friction stays above kinetic friction.
        factor = 0.9 if key.endswith("kinetic") else 1.1
        moved = hammer.replace(key, hammer.constants[key].si * factor or 1e-5)
        for role, part in (("spring", moved.spring), ("damping", moved.damping)):
            assert part is not None
            numbers, found = part.numbers(), evaluated(sums_of(hammer)[role], moved)
            assert found == pytest.approx({index: numbers[index] for index in found}, rel=1e-14), key
