"""Basins of attraction: the attractor that each initial state leads to, and the entropy of the boundaries.

Every state of a grid starts a train at the moment of a firing, with the pulses of earlier firings still
active. Trains are continued, round by round, until their attractors are known. The attractors are found from
the cells themselves. A cell whose train is periodic, by the rule of `printhammer.chaos.strobe.verdict`,
belongs to the basin of that periodic orbit. A few of the aperiodic trains are followed for thousands of
firings. If the exponent of such a train shows that it is strange, its points define a strange attractor, and
cells whose trains lie on this attractor belong to its basin. Cells that fit neither case after the
last round are undecided.

Basin entropy measures how uncertain the attractor is if the initial state is known only to lie in a box.

A. Daza, A. Wagemakers, B. Georgeot, D. Guéry-Odelin and M. A. F. Sanjuán, Basin entropy: a new tool to
analyze uncertainty in dynamical systems, Scientific Reports 6 (2016) 31416.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, SupportsIndex, Unpack

import numpy as np
import numpy.typing as npt

from printhammer.chaos.basins.attractors import Attractor, Attractors
from printhammer.chaos.bifurcation.columns import EFFORT, OK, run_columns, scales_of_columns
from printhammer.chaos.strobe.map import is_possible
from printhammer.chaos.strobe.verdict import LARGEST_PERIOD
from printhammer.drive.input import read_count, read_number
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.results import Column, Declared, Result, column, coordinate, part, scalar
from printhammer.results.declare import Kind
from printhammer.results.summary import (
    FactRow,
    Facts,
    Summary,
    quantity,
    styled,
)
from printhammer.run.effort import Effort, computation
from printhammer.run.regime import Fired, Regime
from printhammer.run.start import AT_REST
from printhammer.support.arrays import FloatArray, IntArray, TextArray

if TYPE_CHECKING:
    import pandas as pd

BOX: Final = 4
"""Default number of cells along the side of a box of the basin entropy; arbitrary."""


class BasinEntropy(Declared):
    """Basin entropy of a plane of cells, in nats."""

    box: int = part("number of cells along the side of a box")
    boxes: int = part("number N of whole boxes with at least one decided cell")
    boundary_boxes: int = part("number Nb of boxes whose cells lead to more than one attractor")
    entropy: float = part(
        "S / N, with S the sum over the boxes of -sum p ln p, p being the shares of the attractors in the"
        " decided cells of the box",
        more="NaN without boxes",
    )
    boundary_entropy: float = part(
        "S / Nb; NaN where no box has more than one attractor",
        more="a value above ln 2 proves a fractal boundary; a smaller value is inconclusive",
    )
    left_out: int = part("number of cells outside whole boxes, or undecided")

    @property
    def fractal(self) -> bool:
        """Whether the boundary entropy exceeds ln 2, which proves a fractal boundary."""
        return self.boundary_entropy > math.log(2.0)


def basin_entropy(labels: npt.ArrayLike, *, box: SupportsIndex = BOX) -> BasinEntropy:
    """Compute the basin entropy of a plane of attractor labels.

    Parameters
    ----------
    labels : int array, shape (n, m)
        Number of the attractor of each cell, counted from 1. Cells of unknown attractor, whose label is 0 or
        negative, are excluded.
    box : int, optional
        Number of cells along the side of a box; cells beyond the last whole box are excluded.

    Raises
    ------
    InputError
        The labels are not a two-dimensional array of integers, or the side of a box is not between 1 cell and
        the shorter side of the plane.
    """
    plane = np.asarray(labels)
    if plane.ndim != 2 or not plane.size or plane.dtype.kind not in "iu":
        raise InputError(
            f"labels: shape {plane.shape}", key="labels", expected="a two-dimensional array of integers"
        )
    side = read_count(box, "box")
    if side > min(plane.shape):
        raise InputError.of("box", box, f"at most {min(plane.shape)} cells")
    rows, columns = (count // side for count in plane.shape)
    cut = plane[: rows * side, : columns * side].reshape(rows, side, columns, side)
    boxes = cut.transpose(0, 2, 1, 3).reshape(rows * columns, side * side)
    kinds = np.unique(boxes[boxes > 0])
    counts = np.stack([(boxes == kind).sum(axis=1) for kind in kinds], axis=1) if kinds.size else None
    if counts is None:
        return BasinEntropy(side, 0, 0, math.nan, math.nan, int(plane.size))
    decided = counts.sum(axis=1)
    counts = counts[decided > 0]
    shares = counts / counts.sum(axis=1, keepdims=True)
    each = -(shares * np.log(np.where(shares > 0.0, shares, 1.0))).sum(axis=1)
    mixed = int(((counts > 0).sum(axis=1) > 1).sum())
    total = float(each.sum())
    return BasinEntropy(
        box=side,
        boxes=len(counts),
        boundary_boxes=mixed,
        entropy=total / len(counts),
        boundary_entropy=total / mixed if mixed else math.nan,
        left_out=int(plane.size - decided.sum()),
    )


def uncertainty_exponent(labels: npt.ArrayLike) -> float:
    """Estimate the uncertainty exponent of the basin boundaries from a plane of attractor labels.

    The fraction of pairs of cells at a distance e that lead to different attractors grows as e^a; a is the
    uncertainty exponent. It is fitted as the slope of the logarithm of this fraction against log e, for
    distances of 1, 2, 4, ... cells in either direction, up to an eighth of the shorter side. The dimension of
    the boundary is 2 - a, so that a is 1 for a smooth boundary and less for a fractal boundary (S. W.
    McDonald, C. Grebogi, E. Ott and J. A. Yorke, Physica D 17 (1985) 125). Cells without a known attractor
    are ignored. The result is NaN if the fraction is nonzero for fewer than three distances.
    """
    plane = np.asarray(labels)
    distances = [2**k for k in range(16) if 2**k <= min(plane.shape) // 8]
    # Subsampling gives every distance the same number of pairs.
    up, across = (length - max(distances, default=0) for length in plane.shape)
    shares = []
    for apart in distances:
        pairs = [
            (plane[:up], plane[apart : apart + up]),
            (plane[:, :across], plane[:, apart : apart + across]),
        ]
        decided = [(here > 0) & (there > 0) for here, there in pairs]
        count = sum(int(both.sum()) for both in decided)
        differ = sum(int(((a != b) & both).sum()) for (a, b), both in zip(pairs, decided, strict=True))
        if count and differ:
            shares.append((math.log(apart), math.log(differ / count)))
    if len(shares) < _FEWEST_DISTANCES:
        return math.nan
    far, differing = np.array(shares).T
    return float(np.polyfit(far, differing, 1)[0])


_FEWEST_DISTANCES: Final = 3
"""Smallest number of distances for a fit of the exponent, since a line fits two points exactly."""

SAMPLE: Final = 256  # Arbitrary
"""Maximum number of cells recomputed at a tenth of the tolerance; never more than an eighth of all cells."""

FIRINGS: Final = 200
"""Default number of firings after which a cell is tested again for its attractor; arbitrary."""

ROUNDS: Final = 20  # Arbitrary
"""Default maximum number of tests for an attractor; a cell that passes none of the tests is undecided."""

CELLS: Final = 128
"""Default number of cells along each side of the plane of initial states; arbitrary."""

MOST_CELLS: Final = 10_000_000
"""Largest number of cells of a plane that `basins` and `printhammer.quench_map` accept; arbitrary."""

UNDECIDED: Final = 0
"""Label of a cell whose attractor is undecided."""

FAILED: Final = -1
"""Label of a cell whose run ended early."""

NO_STATE: Final = -2
"""Label of a cell that is not a valid initial state."""

NO_STATE_STATUS: Final = "no state"

_PIECE: Final = 4096  # Number of trains integrated in one batch, which bounds the memory; arbitrary
_GOLDEN: Final = 0.618033988749895  # Inverse golden ratio, whose multiples modulo 1 spread evenly
_FEWEST: Final = 4  # Smallest number of firings between two tests for an attractor; arbitrary

Range = tuple[float | str, float | str, SupportsIndex]


_ROWS: Final = 12
"""Maximum number of attractors listed in a summary; arbitrary."""


class Basins(Result, rows="v x"):
    """Basins of attraction over a grid of initial states."""

    regime: Regime = part("hammer and periodic drive")
    x: FloatArray = coordinate("m", "displacement at the first firing", "x")
    v: FloatArray = coordinate("m/s", "velocity at the first firing", "v")
    labels: IntArray = column(
        "1",
        "attractor",
        "v x",
        more="number from 1 on; 0: undecided, -1: run ended early, -2: no valid state",
        name="label",
        dtype=np.int32,
    )
    attractors: tuple[Attractor, ...] = part(
        "attractors, sorted by period (strange attractors last), then by smallest displacement"
    )
    firings: IntArray = column(
        "1",
        "number of firings after which the cell was decided",
        "v x",
        more="or after which it stayed undecided",
        dtype=np.int32,
    )
    status: TextArray = column("", "status of the run", "v x", more='or "no state"')
    compared: int = scalar("1", "number of sampled cells that were recomputed at a tenth of the tolerance")
    changed: int = scalar("1", "number of recomputed cells whose label differs, since rounding decides it")
    tolerance: float = part("tolerance of the integration")

    @property
    def title(self) -> str:
        """Title of the basins, with the name of the hammer and the firing period."""
        return f"basins of {self.regime.hammer.name}, every {self.regime.period:.9g} s"

    def summary(self, box: int | None = None) -> Summary:
        """Summarise attractors with their fractions of the cells, undecided cells, and the basin entropy.

        `box` is the number of cells along a side of the boxes of the basin entropy.
        """
        rows: list[FactRow] = []
        for row, (attractor, share, error) in enumerate(zip(self.attractors, *self.shares, strict=True), 1):
            x, v = attractor.states[0].tolist()
            first = "" if attractor.period is None else f", first at {quantity(x, 'm')}, {quantity(v, 'm/s')}"
            name = styled("strong", attractor.name.replace("-", " "))
            rows.append(
                (
                    f"attractor {row}",
                    f"{name}, {100.0 * share:.2f} ± {100.0 * error:.2f} % of the states{first}",
                )
            )
        if len(rows) > _ROWS:
            rows[_ROWS:] = [("", f"and {len(rows) - _ROWS} more")]
        after = f" after {self.firings.max()} firings; more may decide" if self.counts[UNDECIDED] else ""
        rows += [
            (name, f"{self.counts[label]} of {self.labels.size} cells{after if label == UNDECIDED else ''}")
            for label, name in ((UNDECIDED, "undecided"), (FAILED, "ended early"), (NO_STATE, "no state"))
            if self.counts[label] or label == UNDECIDED
        ]
        entropy = self.entropy(box=min(BOX, *self.labels.shape) if box is None else box)
        boundary = (
            "no box on a boundary"
            if math.isnan(entropy.boundary_entropy)
            else f"{entropy.boundary_entropy:.4f} in the {entropy.boundary_boxes} boxes on a boundary"
            f"{', more than ln 2: a fractal one' if entropy.fractal else ''}"
        )
        boxes = f"{entropy.boxes} boxes of {entropy.box} x {entropy.box} cells"
        exponent = uncertainty_exponent(self.labels)
        rows += [
            ("basin entropy", f"{entropy.entropy:.4f} in {boxes}, {boundary}"),
            ("uncertainty exponent", None if math.isnan(exponent) else f"{exponent:.3f}"),
            ("rounding", self.rounding or None),
        ]
        return Summary([Facts(rows)])

    @property
    def rounding(self) -> str:
        """Sentence on the number of sampled cells whose label changes at a tenth of the tolerance.

        Empty if no cell was recomputed.
        """
        if not self.compared:
            return ""
        share = 100.0 * self.changed / self.compared
        return f"{self.changed} of {self.compared} labels ({share:.1f} %) change at a tenth of the tolerance"

    @property
    def names(self) -> dict[int, str]:
        """Name of each cell label: an attractor, "undecided", "run ended early" or "no state"."""
        kinds = {k: attractor.name for k, attractor in enumerate(self.attractors, 1)}
        return {NO_STATE: "no state", FAILED: "run ended early", UNDECIDED: "undecided", **kinds}

    @property
    def counts(self) -> dict[int, int]:
        """Number of cells by label: each attractor, undecided (0), ended early (-1), no state (-2)."""
        every = (NO_STATE, FAILED, UNDECIDED, *range(1, len(self.attractors) + 1))
        return {label: int((self.labels == label).sum()) for label in every}

    @property
    def shares(self) -> tuple[FloatArray, FloatArray]:
        """Fraction p of the initial states that lead to each attractor, and the standard error of p.

        Both arrays have one entry per attractor. The standard error is that of n independent random initial
        states, sqrt(p (1 - p) / n); for a smooth boundary the regular grid is more accurate.
        """
        count = int((self.labels != NO_STATE).sum())
        share = np.array([self.counts[k + 1] for k in range(len(self.attractors))], dtype=np.float64)
        share /= max(count, 1)
        return share, np.sqrt(share * (1.0 - share) / max(count, 1))

    def entropy(self, *, box: SupportsIndex = BOX) -> BasinEntropy:
        """Compute the basin entropy of boxes with `box` cells along a side."""
        return basin_entropy(self.labels, box=box)

    def notes(self) -> dict[str, Any]:
        """Return the basin entropies and the uncertainty exponent, for the attributes of the Dataset."""
        entropy = self.entropy(box=min(BOX, *self.labels.shape))
        return {
            "box": entropy.box,
            "basin_entropy": entropy.entropy,
            "boundary_basin_entropy": entropy.boundary_entropy,
            "uncertainty_exponent": uncertainty_exponent(self.labels),
        }

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return the Dataset variables: cells along `v` and `x`, attractor properties along `attractor`."""
        own = super().entries()
        codes = ", ".join(f"{label} {name}" for label, name in self.names.items())
        own["label"] = replace(own["label"][0], attrs={"codes": codes}), self.labels
        share, error = self.shares
        kinds = np.array([attractor.name for attractor in self.attractors], "U16")
        numbers = np.arange(1, len(self.attractors) + 1, dtype=np.int32)
        for name, unit, meaning, values in (
            ("verdict", "", "kind of attractor", kinds),
            ("share", "1", "fraction of the cells with a state", share),
            ("standard_error", "1", "standard error of the fraction", error),
            ("attractor", "1", "number of the attractor", numbers),
        ):
            sort: Kind = "coordinate" if name == "attractor" else "column"
            own[name] = Column(unit, meaning, ("attractor",), sort, name=name), values
        return own

    def to_dataframe(self) -> pd.DataFrame:
        """Convert the plane to a table with one row per cell, including the name of the cell's attractor."""
        table = super().to_dataframe()
        table.insert(3, "attractor", [self.names[label] for label in table["label"].tolist()])
        return table


@computation
def basins(
    hammer: Hammer | Regime,
    *,
    x: Range | None = None,
    v: Range | None = None,
    firings: SupportsIndex = FIRINGS,
    rounds: SupportsIndex = ROUNDS,
    effort: Effort = EFFORT,
    **firing: Unpack[Fired],
) -> Basins:
    """Compute the basins of attraction: the attractor that each initial state of a grid leads to.

    An initial state inside the pack meets fresh paper, compressed to that depth: it starts on the loading
    branch if the armature moves inward, else on the unloading branch. A state inside the backstop starts with
    the corresponding indentation. With a voltage drive, all states start without current and with a charged
    supply capacitor. Cells outside the range of the magnet's law, or behind a rigid backstop, have no state.

    Parameters
    ----------
    hammer : Hammer or Regime
        The hammer, or a regime; a hammer requires the keywords of `printhammer.Regime.of`. States are those
        at a firing, independent of the phase of the regime.
    x, v : tuple, optional
        Smallest value, largest value and number of values of the displacement [m] and of the velocity [m/s];
        the two limits, which are included, may be text with a unit. By default the strobe window of
        `printhammer.run.regime`, and 128 values.
    firings : int, optional
        Number of firings per round, at least 4; the last half of them, at most 128, is classified.
    rounds : int, optional
        Maximum number of rounds per cell.

    Returns
    -------
    Basins
        A label and a status for each cell; a run that ends early raises no exception.
    """
    regime = Regime.of_firing(hammer, firing).at_firings
    count, most = read_count(firings, "firings"), read_count(rounds, "rounds")
    if count < _FEWEST:
        raise InputError.of("firings", firings, f"at least {_FEWEST}")
    window = regime.window
    across = read_axis((*window.x, CELLS) if x is None else x, "x", "m")
    up = read_axis((*window.v, CELLS) if v is None else v, "v", "m/s")
    check_cells(across.size, up.size)
    cells = np.empty((up.size, across.size, 2 + len(AT_REST)))
    cells[..., 0], cells[..., 1] = across, up[:, np.newaxis]
    cells[..., 2:] = AT_REST
    (scales,) = scales_of_columns([regime])
    known_attractors = Attractors(regime, scales, effort.tolerance)
    rows = cells.reshape(-1, cells.shape[-1])
    labels, used, status = _decided(regime, rows, (count, most), effort, known_attractors)
    attractors = list(known_attractors.found)
    sample = _sample(np.flatnonzero(labels >= 0), len(rows))
    finer = effort.at(0.1 * effort.tolerance)
    again, _, _ = _decided(regime, rows[sample], (count, most), finer, known_attractors.at(finer.tolerance))
    changed = int((again != labels[sample]).sum())
    shape = up.size, across.size
    order = sorted(range(len(attractors)), key=lambda place: _key(attractors[place]))
    number = np.zeros(len(attractors) + 1, np.int64)
    number[np.array(order, np.int64)] = np.arange(1, len(order) + 1)
    known = labels >= 0
    labels[known] = number[labels[known]]
    labels[~known] += 1
    return Basins(
        regime=regime,
        x=across,
        v=up,
        labels=labels.reshape(shape),
        attractors=tuple(attractors[place] for place in order),
        firings=used.reshape(shape),
        status=status.reshape(shape),
        compared=len(sample),
        changed=changed,
        tolerance=effort.tolerance,
    )


def _decided(
    regime: Regime, cells: FloatArray, counts: tuple[int, int], effort: Effort, attractors: Attractors
) -> tuple[IntArray, IntArray, TextArray]:
    """Determine the attractor of each cell; `counts` contains the firings per round and the round limit.

    Returns, for each cell, the index of its attractor (negative if unknown), the number of firings simulated,
    and the status of the run.
    """
    firings, most = counts
    places = np.full(len(cells), UNDECIDED - 1, np.int64)
    used = np.zeros(len(cells), np.int64)
    status = np.full(len(cells), OK, "U16")
    known_states = {x: is_possible(regime.hammer, x, 0.0) for x in np.unique(cells[:, 0]).tolist()}
    absent = np.array([not known_states[x] for x in cells[:, 0].tolist()], np.bool_)
    places[absent], status[absent] = NO_STATE - 1, NO_STATE_STATUS
    states = cells.copy()
    done, known = 0, int((~absent).sum())
    transient = firings - min(2 * LARGEST_PERIOD, firings // 2)
    for _round in range(most):
        left = np.flatnonzero((places == UNDECIDED - 1) & np.isfinite(states[:, 0]))
        for first in range(0, len(left), _PIECE):
            rows = left[first : first + _PIECE]
            part = effort.within(done, known)
            columns = run_columns([regime] * len(rows), states[rows], firings, transient, part)
            judged = attractors.judge(columns)
            places[rows] = np.where(columns.status != OK, FAILED - 1, judged)
            status[rows], states[rows] = columns.status, columns.last
            used[rows] += firings
            done += len(rows)
        known = done + int((places == UNDECIDED - 1).sum())
    return places, used, status


def _sample(decided: IntArray, count: int) -> IntArray:
    """Select an evenly spread sample of the decided cells, to be recomputed at a finer tolerance.

    The sample size depends on `count`, the total number of cells.
    """
    size = min(SAMPLE, max(count // 8, 1), len(decided))
    shares = (np.arange(1, size + 1) * _GOLDEN) % 1.0
    return np.unique(decided[(shares * len(decided)).astype(np.int64)]) if size else decided[:0]


def _key(attractor: Attractor) -> tuple[int, float, float]:
    lowest = int(np.argmin(attractor.states[:, 0]))
    x, v = attractor.states[lowest].tolist()
    return LARGEST_PERIOD + 1 if attractor.period is None else attractor.period, x, v


def read_axis(entry: Any, name: str, unit: str) -> FloatArray:
    """Parse the entry of an axis: lower bound, upper bound, number of values; return the values, SI.

    Raises InputError, with the name of the axis, if the entry is invalid.
    """
    if not isinstance(entry, tuple | list) or len(entry) != 3:
        raise InputError.of(name, entry, "least value, largest value and number of values")
    low, high = (read_number(end, unit, name) for end in entry[:2])
    count = read_count(entry[2], f"{name}: number of values")
    if not low < high or count < 2:
        raise InputError.of(name, entry, "two ascending bounds and a number of at least 2")
    return np.linspace(low, high, count)


def check_cells(across: int, up: int) -> None:
    """Raise InputError if a plane of `across` times `up` cells has more than `MOST_CELLS` cells."""
    if across * up > MOST_CELLS:
        raise InputError(f"{across} x {up} cells", key="cells", expected=f"at most {MOST_CELLS}")
