"""What a report is made of: claims judged, figures drawn, what the reconstruction found."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from printhammer.claims import JudgedClaim
    from printhammer.hammer.hammer import Hammer
    from printhammer.reconstruction.results import Family, Results, Search


@dataclass(frozen=True)
class Drawing:
    """One figure of the paper, drawn."""

    number: int
    """Number in the paper."""
    title: str
    caption: str
    """What it is, and what it shows for this hammer."""
    says: str
    """What the paper says of it, in our words."""
    svg: bytes
    """The picture; empty where it could not be drawn."""
    pdf: Path | None
    """Its file as vectors, seen from the folder of the report."""
    reason: str
    """Why it could not be drawn; empty where it was."""
    claims: tuple[JudgedClaim, ...]
    """Claims that cite the figure."""
    seconds: float
    """Time that it took."""


@dataclass(frozen=True)
class Report:
    """What `write_report` judged, drew and wrote.

    Attributes
    ----------
    hammer : Hammer
        The hammer.
    results : list of JudgedClaim
        The claims, judged.
    drawings : list of Drawing
        The figures.
    provenance : mapping
        Versions, fingerprint, tolerance.
    reconstruction : Results
        Results of a reconstruction, of this hammer or of another.
    seconds : float
        Time that all took.
    files : list of Path
        What was written.
    """

    hammer: Hammer
    results: list[JudgedClaim]
    drawings: list[Drawing]
    provenance: Mapping[str, Any]
    reconstruction: Results
    seconds: float
    files: list[Path] = field(default_factory=list)

    def count(self, verdict: str) -> int:
        """Return how many claims have a verdict."""
        return sum(result.verdict == verdict for result in self.results)

    @property
    def reconstructed(self) -> bool:
        """Whether the hammer is the one that the reconstruction is about."""
        return self.search is not None

    @property
    def search(self) -> Search | None:
        """The search for the constants of this hammer."""
        search = self.reconstruction.search
        return search if search is not None and search.shipped == self.hammer.fingerprint else None

    @property
    def family(self) -> Family | None:
        """The hammers that do as well as this one."""
        return self.reconstruction.family if self.reconstructed else None
