"""Sum of the spring and of the additional forces and contacts of a hammer, with damped contacts.

The force of a contact with the damping chi, the indentation d and the rate d' of the indentation is

    K d^n (1 + chi d'),  at least 0.

Source: K. H. Hunt and F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440. The force is continuous when the
contact closes. A free mass that strikes the contact at the speed u leaves it at the speed v, independent of
mass, K and n:

    chi v + ln(1 - chi v) = ln(1 + chi u) - chi u,

so that the coefficient of restitution is 1 - (2/3) chi u for a small chi u. Validity: local losses in the
material of the contact, below the speed of permanent deformation. Weakness: contacts have no mass, and the
elastic part of the force does not relax.

Packed constants: as in `printhammer.parts.spring.sampled`; the last number of the row of a contact is chi.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from printhammer.errors import InputError
from printhammer.parts.base import SpringPart
from printhammer.parts.spring.forces import LEVELS, MOST, MOST_SAMPLES, WIDTH, ForceSum, Row
from printhammer.parts.spring.sampled import (
    SampledSum,
    spring_domain,
    spring_energy,
    spring_force,
    spring_level,
    spring_packed,
)
from printhammer.parts.spring.terms import LinearContact, SampledForce, Term

__all__ = ["LEVELS", "spring_domain", "spring_energy", "spring_force", "spring_level", "spring_packed"]

VISCOUS = True
"""Whether the law has a dissipative part, which `spring_viscous` returns."""


def spring_viscous(c: Any, x: float, v: float) -> float:
    """Return the dissipative part [N] of the sum of the contact forces at `x` [m] and `v` [m/s]."""
    total = 0.0
    for k in range(int(c[0])):
        row = 1 + WIDTH * k
        side = c[row]
        if side != 0.0 and c[row + 4] > 0.0:
            depth = side * (x - c[row + 1])
            if depth > 0.0:
                rise = max(c[row + 4] * side * v, -1.0)
                total -= side * c[row + 2] * rise * (depth if c[row + 3] == 1.0 else depth ** c[row + 3])
    return float(total)


def spring_switch(c: Any, v: float) -> float:
    """Return a number that changes sign at each velocity at which a contact force is cut off.

    `v` is the velocity of the armature, m/s.
    """
    product = 1.0
    for k in range(int(c[0])):
        row = 1 + WIDTH * k
        if c[row] != 0.0:
            product *= 1.0 + c[row + 4] * c[row] * v
    return float(product)


class DampedForceSum(SampledSum):
    """Sum of the spring of a hammer and of forces and contacts, at least one of which dissipates energy."""

    law: ClassVar[str] = "damped sum"


def sum_of(spring: SpringPart | None, terms: Mapping[str, Term], mass: float) -> ForceSum:
    """Build the sum of a spring, if any, and of additional forces and contacts.

    Parameters
    ----------
    spring : SpringPart or None
        Spring of the hammer.
    terms : mapping
        Forces and contacts by key, such as "force.weight".
    mass : float
        Mass of the armature, kg.

    Raises
    ------
    InputError
        The spring has a law that cannot be added, two contacts on the same side have the same position, there
        are more than `MOST` terms or `MOST_SAMPLES` samples, or two sampled forces have no common range.
    """
    rows = [] if spring is None else [_spring_row(spring)]
    taken: dict[tuple[float, float], str] = {}
    sampled = {key: term for key, term in terms.items() if isinstance(term, SampledForce)}
    for key, term in terms.items():
        if isinstance(term, SampledForce):
            continue
        row = term.row(mass)
        if isinstance(term, LinearContact) and taken.setdefault(row[:2], key) != key:
            raise InputError.of(
                f"{key}.position", row[1], f"another position than that of {taken[row[:2]]}", unit="m"
            )
        rows.append(row)
    entries = len(rows) + len(sampled)
    if entries > MOST:
        raise InputError.of("force", entries, f"at most {MOST} forces and contacts, the spring included")
    damped = any(row[0] != 0.0 and row[4] > 0.0 for row in rows)
    if not (damped or sampled):
        return ForceSum(rows=tuple(rows))
    count = sum(len(term.samples) for term in sampled.values())
    if count > MOST_SAMPLES:
        raise InputError.of("force", count, f"at most {MOST_SAMPLES} samples of all forces")
    curves = tuple((term.interpolation == "linear", term.samples) for term in sampled.values())
    made = (DampedForceSum if damped else SampledSum)(rows=tuple(rows), curves=curves)
    low, high = made.domain
    if not low < high:
        key = next(reversed(sampled))
        expected = "displacements that the other sampled forces have, too"
        raise InputError.of(f"{key}.file", sampled[key].samples[0][0], expected, unit="m")
    return made


def _spring_row(spring: SpringPart) -> Row:
    """Convert a spring to a row of packed constants.

    Raises InputError unless the law of the spring is `linear`, `preload` or `cubic`.
    """
    values = {name: getattr(spring, name) for name in spring.names()}
    if spring.law == "linear":
        return (0.0, math.nan, values["Bs"], -values["Bs"] / values["As"], 0.0)
    if spring.law == "preload":
        return (0.0, math.nan, values["preload"], -values["stiffness"], 0.0)
    if spring.law == "cubic":
        return (0.0, values["center"], 0.0, -values["stiffness"], -values["cubic"])
    expected = "linear, preload or cubic beside [[force]] and [[contact]]"
    raise InputError.of("spring.law", spring.law, expected)
