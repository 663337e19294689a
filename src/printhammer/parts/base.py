"""Base classes of parts: a frozen set of SI constants, a law, and an entry in the registry.

Each part is one file, which contains the law as plain scalar functions of the module (see
`printhammer.parts`) and a `Part` subclass with the constants, decorated with `register`. The kernel compiles
the functions and passes them the floats of `packed` as one float64 array `c`.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, Final, Literal, TypeVar, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError

from printhammer.parts.functions import check_functions
from printhammer.support.constants import invalid, options, quantities

ROLES: tuple[str, ...] = ("magnet", "coil", "spring", "pack", "backstop", "damping")

_ROOM: Final = 16
"""Largest number of packed constants of a law that has a function to pack them; arbitrary."""


class Part(BaseModel):
    """Replaceable part of a hammer: constants in SI, and the module with its law.

    The class attribute `role` is one of `ROLES`, and `law` is the name of the law in hammer files.

    Raises
    ------
    InputError
        A constant is missing, unknown, not a finite number or out of bounds, or a function of the law does
        not take the arguments that the kernel passes.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    role: ClassVar[str]
    law: ClassVar[str]
    variant: ClassVar[int] = 0
    """Index of the law among the laws of its module, which share the law functions."""

    if not TYPE_CHECKING:

        def __init__(self, /, **data: Any) -> None:
            try:
                super().__init__(**data)
            except ValidationError as error:
                raise invalid(error, type(self), f"{self.role}.") from None
            check_functions(type(self))

        # A custom __init__ would lose the context of model_validate (the folder of the file).
        __init__.__pydantic_base_init__ = True

    def packed(self, origin: float) -> tuple[float, ...]:
        """Return the constants [SI] that the law functions read from `c`, in the order stated by the module.

        `origin` is the position [m] of the backstop, b of equation (4), or 0 without a backstop. By default,
        the function ``<role>_packed(q, origin, c)`` of the module computes the constants from `numbers`.
        """
        pack = self.function(f"{self.role}_packed")
        if pack is None:
            raise NotImplementedError
        constants = [0.0] * _ROOM
        return tuple(constants[: pack(self.numbers(), origin, constants)])

    @classmethod
    def function(cls, name: str) -> Any:
        """Return the law function `name` of the module of the class or of a base class; None if missing."""
        modules = (vars(sys.modules[base.__module__]) for base in cls.__mro__ if issubclass(base, Part))
        return next((module[name] for module in modules if name in module), None)

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Return the names of the fields in `numbers`: first physical constants, then options.

        Both are in the order in which the class declares them.
        """
        further = (name for name, kind in options(cls).items() if kind is bool or get_origin(kind) is Literal)
        return (*quantities(cls), *further)

    def numbers(self) -> tuple[float, ...]:
        """Return the fields as numbers, and the index of the law among the laws of its module.

        A missing constant becomes NaN, a Boolean option 0 or 1, and any other option the index of its choice.
        """
        fields = _fields(type(self))
        return (*[_number(getattr(self, name), choices) for name, choices in fields], float(self.variant))

    def content(self) -> Mapping[str, Any]:
        """Return the numbers read from an additional file, such as a table, for the digest of the hammer."""
        return {}

    @property
    def module(self) -> str:
        """Dotted name of the module that holds the law functions."""
        return type(self).__module__


class MagnetPart(Part):
    """Base class of magnets, with the law `magnet_force(c, x, current)` and `magnet_energy(c, x)`."""

    role: ClassVar[str] = "magnet"

    @property
    def domain(self) -> tuple[float, float]:
        """Range of displacements in which the law is valid, `(x_min, x_max)`, m.

        By default the function ``magnet_domain(q, ends)`` of the module writes the range to `ends`.
        """
        ends = [-math.inf, math.inf]
        bounds = self.function("magnet_domain")
        if bounds is not None:
            bounds(self.numbers(), ends)
        return (ends[0], ends[1])

    @property
    def has_linkage(self) -> bool:
        """Whether the law defines a flux linkage, so that a voltage can drive the coil."""
        return hasattr(sys.modules[self.module], "magnet_linkage")


class CoilPart(Part):
    """Base class of coil circuits, with the law of `printhammer.kernel.model.circuit`.

    The packed constants have the order of the kernel's parameter array; see
    `printhammer.kernel.model.layout`.
    """

    role: ClassVar[str] = "coil"


class SpringPart(Part):
    """Base class of springs, with the law `spring_force(c, x)` and `spring_energy(c, x)`.

    A spring that dissipates energy also has `VISCOUS` and `spring_viscous`.
    """

    role: ClassVar[str] = "spring"

    @property
    def domain(self) -> tuple[float, float]:
        """Range of displacements in which the law is valid, `(x_min, x_max)`, m; by default unlimited."""
        return (-math.inf, math.inf)

    @property
    def viscous(self) -> bool:
        """Whether the spring dissipates energy."""
        return bool(self.function("VISCOUS"))


def domain_of(*parts: MagnetPart | SpringPart | None) -> tuple[float, float]:
    """Return the range of displacements in which the laws of all parts are valid, `(x_min, x_max)`, m."""
    ranges = [(-math.inf, math.inf), *(part.domain for part in parts if part is not None)]
    return max(low for low, _ in ranges), min(high for _, high in ranges)


class PackPart(Part):
    """Base class of ribbon and paper packs.

    A pack defines `pack_loading`, `pack_memory`, `pack_unloading` and `MEMORY`; a rigid stop defines
    `RIGID_FRONT` and `pack_rebound` instead. A subclass has the constant `front`, the displacement [m] at
    which the armature first touches the pack.
    """

    role: ClassVar[str] = "pack"

    front: float

    @property
    def rigid(self) -> bool:
        """Whether the pack's front is a rigid stop, from which the armature rebounds without a pack force."""
        return bool(self.function("RIGID_FRONT"))


class BackstopPart(Part):
    """Base class of backstops.

    A rigid backstop defines `RIGID` and `backstop_rebound`; any other backstop defines `backstop_elastic`,
    `backstop_viscous` and `backstop_energy`. A subclass has the constant `position`, the displacement [m] at
    which the armature first touches the backstop.
    """

    role: ClassVar[str] = "backstop"

    position: float

    @property
    def rigid(self) -> bool:
        """Whether the backstop is rigid: the armature rebounds without a contact time."""
        return bool(self.function("RIGID"))


class DampingPart(Part):
    """Base class of dampings, which act on the armature at every displacement.

    A subclass defines `damping_force(c, v)`, a smooth function of v.
    """

    role: ClassVar[str] = "damping"


PARTS: dict[tuple[str, str], type[Part]] = {}

_P = TypeVar("_P", bound=type[Part])


def register(part: _P) -> _P:
    """Class decorator that registers a part class under its role and law.

    A registered class that was defined in a notebook cell may be replaced by a class with the same role and
    law, since no hammer can be built from a class without a source file.

    Raises
    ------
    ValueError
        If the role is unknown, or another class from a file has the same role and law.
    """
    if part.role not in ROLES:
        known = ", ".join(ROLES)
        raise ValueError(f"part {part.__name__} has the role {part.role!r}: expected one of {known}")
    key = (part.role, part.law)
    taken = PARTS.get(key)
    same = taken is not None and (taken.__module__, taken.__qualname__) == (
        part.__module__,
        part.__qualname__,
    )
    if taken is not None and not same and hasattr(sys.modules.get(taken.__module__), "__file__"):
        raise ValueError(f"the {part.role} law {part.law!r} is already taken by {taken.__module__}")
    PARTS[key] = part
    return part


def laws(role: str) -> tuple[str, ...]:
    """List the names of the registered laws of a role, sorted."""
    return tuple(sorted(law for known, law in PARTS if known == role))


@cache
def _fields(part: type[Part]) -> tuple[tuple[str, tuple[Any, ...] | None], ...]:
    """List the fields in `Part.numbers` as pairs: name, and allowed words of a text option, else None."""
    kinds = options(part)
    words = {name: get_args(kind) for name, kind in kinds.items() if get_origin(kind) is Literal}
    return tuple((name, words.get(name)) for name in part.names())


def _number(value: Any, choices: tuple[Any, ...] | None) -> float:
    """Convert the value of a field to a number: one of `choices` to its index, None to NaN."""
    if choices is not None:
        return float(choices.index(value))
    return math.nan if value is None else float(value)
