"""What a report is made of: claims judged, figures drawn, what the reconstruction found."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.results import Declared, part

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from printhammer.claims import JudgedClaim
    from printhammer.hammer.hammer import Hammer
    from printhammer.report.reconstruction.results import Family, Results, Search


class Drawing(Declared):
    """One figure of the paper, drawn."""

    number: int = part("number in the paper")
    title: str = part("what it is")
    caption: str = part("what it shows for this hammer")
    says: str = part("what the paper says of it, in our words")
    svg: bytes = part("the picture; empty where it could not be drawn")
    pdf: Path | None = part("its file as vectors, seen from the folder of the report")
    reason: str = part("why it could not be drawn; empty where it was")
    claims: tuple[JudgedClaim, ...] = part("claims that cite the figure")
    seconds: float = part("time that it took")


class Report(Declared):
    """What `write_report` judged, drew and wrote."""

    hammer: Hammer = part("the hammer")
    results: list[JudgedClaim] = part("the claims, judged")
    drawings: list[Drawing] = part("the figures")
    provenance: Mapping[str, Any] = part("versions, fingerprint, tolerance")
    reconstruction: Results = part("results of a reconstruction, of this hammer or of another")
    seconds: float = part("time that all took")
    files: list[Path] = part("what was written", default_factory=list)

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
