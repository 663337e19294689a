"""Report of a benchmark: results as data, JSON and Markdown."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from benchmarks.solvers.ensembles import DISPLAY, EXACT, Figures, Mass
from printhammer.results import Declared, part

if TYPE_CHECKING:
    from benchmarks.solvers.table import Line

Rows = list[tuple[str, ...]]

SOLVER_HEADS: Final = (
    *("solver", "error [m]", "hammer-s/s", "first call [s]", "printhammer tolerance", "speed ratio"),
)
FRAME_HEADS: Final = (
    *("engine", "tolerance", "error, median", "95 %", "threads", "median [ms]", "best [ms]"),
    "hammer-s/s/thread",
)
MASS_HEADS: Final = (
    *("engine", "tolerance", "members", "pulses", "threads", "hammer-s", "seconds", "us a member"),
    "hammer-s/s/thread",
)


class Report(Declared):
    """Results of a benchmark: machine, solvers, ensembles and compilation times."""

    machine: dict[str, str] = part("description of the machine")
    quick: bool = part("whether the benchmark was a short test, whose timings are not meaningful")
    lines: list[Line] = part("table rows, one per solver, method and tolerance")
    absent: dict[str, str] = part("reasons for missing solvers (not installed, or failed), by name")
    figures: Figures = part("timings of ensembles")
    compiling: dict[str, float] = part(
        "time to compile the code of an ensemble, s, by engine; empty in a quick benchmark"
    )
    peers: str = part("text about the use of the other solvers", default="")

    def to_json(self) -> str:
        """Return the results as JSON; NaN and infinity become null."""
        figures = asdict(self.figures)
        for kind in ("masses", "growth"):
            for row, mass in zip(figures[kind], getattr(self.figures, kind), strict=True):
                row["speed"] = mass.speed
        data = {
            "machine": self.machine,
            "quick": self.quick,
            "solvers": [asdict(line) for line in self.lines],
            "absent": self.absent,
            "ensembles": figures,
            "compiling_s": self.compiling,
        }
        return json.dumps(_finite(data), indent=1, allow_nan=False) + "\n"

    def solvers(self, *, ensembles: bool) -> Rows:
        """Return the table rows of the single runs or of the ensembles."""
        rows: Rows = []
        for line in self.lines:
            if (line.members > 1) != ensembles:
                continue
            error = "lost" if math.isnan(line.error) else f"{line.error:.1e}"
            none = "" if line.ours else "-"
            ratio = none if math.isnan(line.ratio) else f"{line.ratio:.3g}"
            match = line.match.removeprefix("printhammer, ")
            rows.append((line.solver, error, f"{line.speed:.3g}", f"{line.first:.1f}", match, ratio))
        return rows

    def least_lead(self, *, ensembles: bool) -> str:
        """Describe, in a sentence, the other solver that is fastest relative to printhammer."""
        ratios = {
            line.solver: line.ratio
            for line in self.lines
            if (line.members > 1) == ensembles and not math.isnan(line.ratio)
        }
        if not ratios:
            return "There is no other solver to compare with."
        nearest = min(ratios, key=ratios.__getitem__)
        return (
            "At the same error, the fastest other solver is the one in the row"
            f' "{nearest}"; printhammer is {ratios[nearest]:.3g} times as fast.'
        )

    def frames(self) -> Rows:
        """Return the table rows of the timings of Figure 9."""
        return [
            (
                frame.engine,
                f"{frame.tolerance:.0e}",
                f"{frame.error_median:.1e}",
                f"{frame.error_95:.1e}",
                str(frame.threads),
                f"{frame.seconds * 1e3:.3g}",
                f"{frame.best * 1e3:.3g}",
                f"{self.figures.hammer_seconds / frame.seconds / frame.threads:.3g}",
            )
            for frame in self.figures.frames
        ]

    def masses(self) -> Rows:
        """Return the table rows of the timings of long trains."""
        return [_mass(mass) for mass in self.figures.masses]

    def growth(self) -> Rows:
        """Return the table rows of the growth with the number of members."""
        return [_mass(mass) for mass in self.figures.growth]

    def frame_sentences(self) -> list[str]:
        """Return sentences with the time of Figure 9 at display accuracy and at full accuracy."""
        sentences = []
        for name, error in (("display", DISPLAY), ("exact", EXACT)):
            for threads in sorted({frame.threads for frame in self.figures.frames}):
                frame = self.figures.fastest(error, threads)
                shown = "no setting"
                if frame is not None:
                    how = f"{frame.engine} engine, tolerance {frame.tolerance:.0e}"
                    shown = f"{frame.seconds * 1e3:.3g} ms ({how})"
                on = f"{threads} thread{'s' if threads > 1 else ''}"
                sentences.append(f"{name}, median error below {error:.0e} of the stroke, {on}: {shown}")
        return sentences

    def to_markdown(self) -> str:
        """Render the documentation page with all tables."""
        from jinja2 import Environment, FileSystemLoader, StrictUndefined

        # The output is Markdown, not HTML, so that nothing is escaped.
        pages = Environment(
            loader=FileSystemLoader(Path(__file__).parent),
            undefined=StrictUndefined,
            trim_blocks=True,
            lstrip_blocks=True,
            keep_trailing_newline=True,
        )
        page = pages.get_template("page.md.j2").render(
            report=self, solver_heads=SOLVER_HEADS, frame_heads=FRAME_HEADS, mass_heads=MASS_HEADS
        )
        return page.rstrip("\n") + "\n"


def _mass(mass: Mass) -> tuple[str, ...]:
    return (
        mass.engine,
        f"{mass.tolerance:.0e}",
        str(mass.members),
        str(mass.pulses),
        str(mass.threads),
        f"{mass.hammer_seconds:.3g}",
        f"{mass.seconds:.3g}",
        f"{mass.seconds / mass.members * 1e6:.4g}",
        f"{mass.speed:.3g}",
    )


def _finite(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data
