"""The figures of a benchmark, as data, as JSON and in Markdown."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final

from printhammer.bench.ensembles import DISPLAY, EXACT

if TYPE_CHECKING:
    from printhammer.bench.ensembles import Figures, Mass
    from printhammer.bench.table import Line

Rows = list[tuple[str, ...]]

SOLVER_HEADS: Final = (
    *("solver", "error [m]", "hammer-s/s", "first call [s]", "ours as exact", "ours / theirs"),
)
FRAME_HEADS: Final = (
    *("engine", "tolerance", "error, median", "95 %", "threads", "median [ms]", "best [ms]"),
    "hammer-s/s/thread",
)
MASS_HEADS: Final = (
    *("engine", "tolerance", "members", "pulses", "threads", "hammer-s", "seconds", "us a member"),
    "hammer-s/s/thread",
)


@dataclass(frozen=True)
class Report:
    """All figures of a benchmark.

    Attributes
    ----------
    machine : dict
        What it ran on.
    quick : bool
        Whether it was a short one, whose figures mean little.
    lines : list of Line
        The solvers.
    absent : dict
        Peers that are not installed here, or failed, and why.
    figures : Figures
        Figures about ensembles.
    compiling : dict
        Time to compile everything that an ensemble needs, by engine, s; empty in a quick benchmark.
    peers : str
        How the peers are used, in words.
    """

    machine: dict[str, str]
    quick: bool
    lines: list[Line]
    absent: dict[str, str]
    figures: Figures
    compiling: dict[str, float]
    peers: str = ""

    def to_json(self) -> str:
        """Return the figures as JSON; null where there is no number."""
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
        """Return the rows of the single runs, or of the ensembles."""
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
        """Say over which peer this program is ahead by least, or which it is behind."""
        ratios = {
            line.solver: line.ratio
            for line in self.lines
            if (line.members > 1) == ensembles and not math.isnan(line.ratio)
        }
        if not ratios:
            return "There is no peer to compare with."
        nearest = min(ratios, key=ratios.__getitem__)
        return f"The nearest: {nearest}, ours / theirs = {ratios[nearest]:.3g}."

    def frames(self) -> Rows:
        """Return the rows of Figure 9."""
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
        """Return the rows of long trains."""
        return [_mass(mass) for mass in self.figures.masses]

    def growth(self) -> Rows:
        """Return the rows of growth with members."""
        return [_mass(mass) for mass in self.figures.growth]

    def frame_sentences(self) -> list[str]:
        """Say how fast Figure 9 is where its error is small enough for a picture, and where it is exact."""
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
        """Return the page of the documentation."""
        parts = [
            "# Benchmarks",
            _INTRODUCTION,
            "This run: " + ", ".join(f"{name} {value}" for name, value in self.machine.items()) + ".",
        ]
        if self.quick:
            parts.append("It was a quick one, to see that everything works: read nothing into its figures.")
        parts += [
            "## One run at a time",
            _SINGLE,
            _table(SOLVER_HEADS, self.solvers(ensembles=False)),
            self.least_lead(ensembles=False),
            "## Ensembles",
            _ENSEMBLE,
            _table(SOLVER_HEADS, self.solvers(ensembles=True)),
            self.least_lead(ensembles=True),
            self.peers,
            _MEMBERS,
        ]
        if self.absent:
            parts.append("Not measured here:")
            parts.append("\n".join(f"- {name}: {reason}" for name, reason in self.absent.items()))
        parts += [
            "## Figure 9 in one display frame",
            self._frame_words(),
            _table(FRAME_HEADS, self.frames()),
            "\n".join(f"- {sentence}" for sentence in self.frame_sentences()),
        ]
        if self.compiling:
            times = ", ".join(
                f"{seconds:.0f} s ({engine} engine)" for engine, seconds in self.compiling.items()
            )
            parts.append(f"Compiling, once for a combination of laws and then kept on disk: {times}.")
        parts += [
            "## Long trains",
            "Rates as above, no output but status, end and steps.",
            _table(MASS_HEADS, self.masses()),
            "## Growth with the number of members",
            _GROWTH,
            _table(MASS_HEADS, self.growth()),
        ]
        return "\n\n".join(filter(None, parts)) + "\n"

    def _frame_words(self) -> str:
        f = self.figures
        return (
            f"{f.rates} firing rates from 500 Hz to 2 kHz, {f.pulses} pulses and 1 ms each, together"
            f" {f.hammer_seconds:.3g} hammer-seconds;\n"
            f"the displacement at {f.times} times goes into a float32 array allocated beforehand, sampling"
            " is included.\n"
            f"Wall-clock time, median of many. Errors in strokes: median and 95th percentile over {f.checked}"
            " members of the\n"
            "largest error before their horizon, where two references, tolerances 1e-13 and 1e-14, part by"
            " 1e-10 of the stroke."
        )


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


def _table(heads: tuple[str, ...], rows: Rows) -> str:
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines)


def _finite(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


_INTRODUCTION = """\
Made by `make bench`, which is `printhammer bench --peers benchmarks/peers --markdown docs/benchmarks.md`. The
wheel measures itself; `--peers` adds other solvers from a folder, those of them that are installed.
`benchmarks/peers/requirements.txt` names them, and `benchmarks/peers/__init__.py` tells how to give them an
environment of their own. The hammer is `src/printhammer/bench/frozen-hammer.toml`, which is never changed, so
that figures can be compared over time. Read the ratios: speeds are those of one machine on one day."""

_SINGLE = """\
A train of 1.35 ms from rest. Error: the largest deviation of the displacement from the reference
(`src/printhammer/reference/integrator.py`, tolerance 1e-14) over the first 3 ms, on a grid of 1 us. Speed:
hammer-seconds per second of processor time without output, over 50 pulses; 20 for numbalsoda, 3 ms for
solvers that call Python at every step. All solvers have their turn in each of seven rounds, so that a
busy machine slows all alike, and the best turn counts. The first call compiles and is stated apart. The
last columns: the fastest of our tolerances whose error is not larger, and how many times faster it is."""

_ENSEMBLE = """\
Trains with periods from 0.9 to 1.1 times 1.35 ms, on one thread; processor time. Error: the largest
deviation of eight members at ten times up to 3 ms."""

_MEMBERS = """\
The error of a single run of printhammer and of a member of an ensemble may differ, since other members are
compared."""

_GROWTH = """\
The runs of Figure 9 with more and more members, on one thread; cost is linear where the time of a member
stays."""
