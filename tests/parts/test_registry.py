"""Every part: registered, complete, frozen, compilable by numba, identical in Python and machine code."""

import inspect
import pickle
from importlib import import_module
from types import ModuleType

import numpy as np
import pytest

from printhammer.errors import InputError
from printhammer.parts import (
    PARTS,
    ROLES,
    BackstopPart,
    CoilPart,
    DampingPart,
    MagnetPart,
    PackPart,
    Part,
    SpringPart,
    laws,
    register,
)
from printhammer.parts.backstop.elastomer import ElastomerBackstop
from printhammer.parts.backstop.hertz import HertzBackstop
from printhammer.parts.backstop.rigid import RigidBackstop
from printhammer.parts.coil import Winding
from printhammer.parts.damping import ViscousDamping
from printhammer.parts.magnet.inverse_root import InverseRootMagnet
from printhammer.parts.magnet.linkage_table import LinkageTableMagnet
from printhammer.parts.magnet.moving_coil import MovingCoilMagnet
from printhammer.parts.magnet.reluctance import ReluctanceMagnet
from printhammer.parts.magnet.table import TableMagnet
from printhammer.parts.pack.dashpot import DashpotPack
from printhammer.parts.pack.power import PowerPack
from printhammer.parts.pack.rigid import RigidFront
from printhammer.parts.spring.cubic import CubicSpring
from printhammer.parts.spring.linear import LinearSpring, PreloadSpring
from printhammer.support.constants import options, quantities
from printhammer.units import to_si

ARGUMENTS = {
    "magnet_force": 3,
    "magnet_energy": 2,
    "magnet_linkage": 3,
    "magnet_emf": 3,
    "magnet_inductance": 3,
    "magnet_current": 4,
    "spring_force": 2,
    "spring_energy": 2,
    "pack_loading": 3,
    "pack_memory": 2,
    "pack_unloading": 4,
    "pack_switch": 3,
    "pack_rebound": 2,
    "backstop_elastic": 2,
    "backstop_viscous": 3,
    "backstop_energy": 2,
    "backstop_switch": 3,
    "backstop_rebound": 2,
    "damping_force": 2,
}
EXAMPLES: list[Part] = [
    InverseRootMagnet(F0=2.47, Am=0.437, Bm=0.093),
    TableMagnet.from_arrays(
        [1e-4, 2e-4, 3e-4, 4e-4],
        [-1.0, 0.0, 2.0],
        [[k * j + 0.1 * j * j for j in range(3)] for k in range(4)],
    ),
    LinkageTableMagnet.from_arrays(
        [1e-4, 2e-4, 3e-4, 4e-4],
        [0.0, 0.5, 1.0, 1.5],
        [[1e-3 * (5 - k) * (j - 0.05 * j * j) for j in range(4)] for k in range(4)],
    ),
    MovingCoilMagnet(constant=4.2),
    ReluctanceMagnet(
        turns=400.0,
        pole_area=3e-5,
        closed_at=1e-3,
        residual_gap=1e-4,
        core_reluctance=4e5,
        saturation_flux=5e-5,
    ),
    LinearSpring(Bs=14.0, As=4.7e-4),
    PreloadSpring(preload=14.0, stiffness=-3e4),
    CubicSpring(stiffness=-2e4, cubic=4e12, center=1.2e-4),
    PowerPack(stiffness=259.0, front=1.5e-4, thickness=1.8e-4),
    DashpotPack(stiffness=1e5, damping=2.0, front=1.5e-4),
    HertzBackstop(position=5e-5, stiffness=1.2e9, damping=4e8),
    ElastomerBackstop(position=5e-5, stiffness=8e7, relaxation_time=2e-5),
    RigidFront(front=1.5e-4, restitution=0.4),
    RigidBackstop(position=5e-5, restitution=0.4),
    ViscousDamping(coefficient=0.5),
    Winding(resistance=3.0, inductance=2e-3),
]
BASES = {
    "magnet": MagnetPart,
    "coil": CoilPart,
    "spring": SpringPart,
    "pack": PackPart,
    "backstop": BackstopPart,
    "damping": DampingPart,
}


def ids(part: Part) -> str:
    return f"{part.role}-{part.law}"


def functions(module: ModuleType, role: str) -> dict[str, object]:
    return {
        name: getattr(module, name) for name in ARGUMENTS if name.startswith(role) and hasattr(module, name)
    }


def test_there_is_an_example_of_every_part() -> None:
    assert {(part.role, part.law) for part in EXAMPLES} == set(PARTS)
    assert {role for role, _ in PARTS} == set(ROLES)


def test_absent_has_every_law_with_its_arguments() -> None:
    absent = import_module("printhammer.parts.absent")
    assert absent.MEMORY is False
    assert absent.RIGID is False
    assert absent.RIGID_FRONT is False
    for name, count in ARGUMENTS.items():
        assert len(inspect.signature(getattr(absent, name)).parameters) == count


def test_absent_parts_do_nothing() -> None:
    absent = import_module("printhammer.parts.absent")
    for name, count in ARGUMENTS.items():
        ones = dict.fromkeys(("pack_switch", "backstop_switch", "magnet_current"), 1.0)
        expected = {**ones, "backstop_rebound": 0.5, "pack_rebound": 0.5}.get(name, 0.0)
        assert getattr(absent, name)(None, *[-0.5] * (count - 1)) == expected


@pytest.mark.parametrize("part", EXAMPLES, ids=ids)
def test_part_is_whole(part: Part) -> None:
    kind = type(part)
    assert PARTS[part.role, part.law] is kind
    assert issubclass(kind, BASES[part.role])
    assert part.law in laws(part.role)
    assert all(isinstance(number, float) for number in part.packed(5e-5))
    module = import_module(part.module)
    assert module.__doc__ is not None
    assert all(word in module.__doc__ for word in ("Source:", "Validity:", "Weakness:", "Packed constants:"))
    found = functions(module, part.role)
    # The circuit of a coil is the kernel's own.
    assert found or part.role == "coil"
    for name, function in found.items():
        assert len(inspect.signature(function).parameters) == ARGUMENTS[name]  # type: ignore[arg-type]
    for name, note in quantities(kind).items():
        assert to_si(1.0, note.si, note.si) == 1.0
        assert note.meaning
        assert note.symbol
        assert note.required == kind.model_fields[name].is_required()
    assert not set(quantities(kind)) & set(options(kind))


@pytest.mark.parametrize("part", EXAMPLES, ids=ids)
def test_part_is_frozen_and_travels(part: Part) -> None:
    name = next(iter(type(part).model_fields))
    with pytest.raises(ValueError, match="frozen"):
        setattr(part, name, 1.0)
    again = pickle.loads(pickle.dumps(part))
    assert again == part
    assert again.packed(5e-5) == part.packed(5e-5)


# Roundings differ where the compiler contracts a product and a sum; a few units in the last place.
@pytest.mark.parametrize("part", EXAMPLES, ids=ids)
def test_machine_code_agrees_with_python(part: Part) -> None:
    import numba

    from printhammer.kernel.compile.templates import compile_law

    c = np.array(part.packed(5e-5))
    values = {
        "x": 2.3e-4,
        "current": 0.4,
        "linkage": 1e-3,
        "inductance": 2e-3,
        "v": -0.7,
        "q": 2e5,
        "peak": 2.9e-4,
        "w": 3e-3,
        "v_in": -0.5,
    }
    for function in functions(import_module(part.module), part.role).values():
        names = [name for name in inspect.signature(function).parameters if name != "c"]  # type: ignore[arg-type]
        arguments = [values[name] for name in names]
        compiled = compile_law(function, numba.njit)  # type: ignore[arg-type]
        assert compiled(c, *arguments) == pytest.approx(function(c, *arguments), rel=1e-14)  # type: ignore[operator]


@pytest.mark.parametrize(
    ("kind", "fields", "sentence"),
    [
        (LinearSpring, {"Bs": -1.0, "As": 1.0}, "spring.Bs = -1.0: expected more than 0 N"),
        (LinearSpring, {"Bs": 1.0}, "spring.As is missing: expected travel from the backstop"),
        (
            LinearSpring,
            {"Bs": 1.0, "As": 1.0, "Cs": 1.0},
            "spring.Cs = 1.0 is not known: expected one of Bs, As",
        ),
        (LinearSpring, {"Bs": float("nan"), "As": 1.0}, "spring.Bs = nan: expected"),
        (
            RigidBackstop,
            {"position": 0.0, "restitution": 1.5},
            "restitution = 1.5: expected 0 or more and 1 or less",
        ),
        (
            PowerPack,
            {"stiffness": 1.0, "front": 0.0, "thickness": 0.0},
            "thickness = 0.0: expected more than 0 m",
        ),
        (HertzBackstop, {"position": 0.0, "damping": 1.0}, "backstop: expected stiffness, or instead"),
        (HertzBackstop, {"position": 0.0, "stiffness": 1.0}, "backstop: expected damping, or instead"),
        (
            HertzBackstop,
            {"position": 0.0, "stiffness": 1.0, "damping": 1.0, "restitution": 0.5},
            "backstop: expected damping, or instead",
        ),
        (
            HertzBackstop,
            {"position": 0.0, "stiffness": 1.0, "restitution": 0.5},
            "backstop: expected damping, or instead",
        ),
        (
            HertzBackstop,
            {"position": 0.0, "stiffness": 1.0, "damping": 1.0, "radius2": 1.0},
            "backstop: expected stiffness, or instead",
        ),
        (
            HertzBackstop,
            {"position": 0.0, "damping": 1.0, "radius1": 1.0, "youngs_modulus1": 1.0},
            "backstop: expected stiffness, or instead",
        ),
        (
            InverseRootMagnet,
            {"F0": 1.0, "Am": 1.0, "Bm": 1.0, "range_min": 2.0, "range_max": 1.0},
            "magnet: range_min is not below range_max",
        ),
    ],
)
def test_a_part_refuses_in_one_sentence(kind: type[Part], fields: dict[str, object], sentence: str) -> None:
    with pytest.raises(InputError) as caught:
        kind(**fields)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_part_from_elsewhere_can_register(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("printhammer.parts.base.PARTS", dict(PARTS))

    class Rubber(SpringPart):
        law = "rubber"

    assert register(Rubber) is Rubber
    assert "rubber" in laws("spring")

    class Other(SpringPart):
        law = "rubber"

    with pytest.raises(ValueError, match="already taken"):
        register(Other)

    class Wheel(Part):
        role = "wheel"
        law = "round"

    with pytest.raises(ValueError, match="expected one of magnet, coil, spring, pack, backstop"):
        register(Wheel)


def test_domains() -> None:
    magnet = InverseRootMagnet(F0=1.0, Am=1.0, Bm=1.0, range_min=1e-5, range_max=5e-4)
    assert magnet.domain == (1e-5, 5e-4)
    assert InverseRootMagnet(F0=1.0, Am=1.0, Bm=1.0).domain == (0.0, float("inf"))
