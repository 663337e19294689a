"""How far a dot may be off: limits on force, arrival and extra contacts."""

from __future__ import annotations

from typing import Final

from printhammer.errors import InputError
from printhammer.results import Declared, part


class Limits(Declared):
    """How far a dot may differ from that of the single pulse. A lost dot is never within limits.

    Raises
    ------
    InputError
        A limit is negative or not a number.
    """

    force: float = part(
        "largest deviation of the peak force to either side, in parts of the single-pulse force", default=0.1
    )
    arrival: float = part(
        "largest deviation of the touch from slot time plus single-pulse flight time, to either side, s",
        default=50e-6,
    )
    extra_contacts: int = part("largest number of further pack contacts", default=0)

    def __post_init__(self) -> None:
        for name, unit in (("force", ""), ("arrival", " s"), ("extra_contacts", "")):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not value >= 0.0:
                raise InputError(f"limits: {name} = {value!r}{unit} is expected to be a number not below 0")

    @property
    def text(self) -> str:
        """In words."""
        return (
            f"force within {100.0 * self.force:g} %, arrival within {1e6 * self.arrival:g} us,"
            f" {self.extra_contacts} extra contacts"
        )


DOT_MATRIX_SPREAD: Final = 200e-6
"""Peak-to-peak flight-time variation that is "commonly accepted in the industry as long as the impact forces
are adequate" in dot matrix printing; F. Hendriks, IBM J. Res. Develop. 27 (1983), introduction; s."""

ENGRAVED_SPREAD: Final = 30e-6
"""Flight-time variation that an engraved-character line printer bears, s. The paper (introduction): "severe
print quality degradation [...] occurs when the flight time varies more than a few tens of microseconds"."""

PRESETS: Final = {
    "slots": Limits(),
    "dot-matrix": Limits(arrival=0.5 * DOT_MATRIX_SPREAD),
    "engraved": Limits(arrival=0.5 * ENGRAVED_SPREAD),
}
"""Limits by name. The spreads of the paper are peak to peak, so that half of each is allowed to either side;
"slots" are the limits by which drives are compared."""


def limits_named(name: str) -> Limits:
    """Return the limits of a name.

    Raises
    ------
    InputError
        There are none of that name.
    """
    if name not in PRESETS:
        raise InputError(f"limits = {name!r}, expected one of {', '.join(PRESETS)}")
    return PRESETS[name]
