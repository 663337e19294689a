import dataclasses
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused

import printhammer as ph
from printhammer.chaos import basin_entropy
from printhammer.chaos.basins import attractors
from printhammer.chaos.basins.attractors import Attractors
from printhammer.chaos.basins.basins import FAILED, NO_STATE, UNDECIDED, Basins, uncertainty_exponent
from printhammer.chaos.bifurcation.columns import Columns
from printhammer.run.regime import Regime
from printhammer.run.start import AT_REST

PLANE = {"x": (20e-6, 260e-6, 9), "v": (-1.0, 1.0, 8)}
LN2 = math.log(2.0)


@pytest.fixture(scope="module")
def two(hammer: "ph.Hammer") -> Basins:
    """Return a train with two orbits of period 1."""
    return ph.basins(hammer, period=1.3e-3, **PLANE)


def test_every_cell_leads_where_its_train_does(hammer: "ph.Hammer", two: Basins) -> None:
    assert [attractor.name for attractor in two.attractors] == ["period-1", "period-1"]
    assert two.attractors[0].states[0, 0] < two.attractors[1].states[0, 0]
    assert set(two.labels.flat) == {1, 2}
    assert two.labels.shape == (8, 9)
    half = two.regime.window.half_widths
    for row, column in ((0, 0), (3, 4), (7, 8), (5, 1)):
        state = two.x[column], two.v[row]
        # Before the first firing that counts the train has been fired, so that its pulse is under way.
        found = ph.bifurcation(hammer, periods=[1.3e-3], state=state, refine=0, firings=402, transient=400)
        orbit = two.attractors[two.labels[row, column] - 1].states
        end = np.array([found.x[0, 0, -1], found.v[0, 0, -1]])
        assert np.abs((end - orbit[0]) / half).max() < 1e-5


def test_shares_and_their_errors(two: Basins) -> None:
    share, error = two.shares
    assert share.sum() == pytest.approx(1.0)
    assert share[0] == (two.labels == 1).sum() / 72
    np.testing.assert_allclose(error, np.sqrt(share * (1.0 - share) / 72.0))
    counts = two.counts
    assert sum(counts.values()) == 72
    assert (counts[UNDECIDED], counts[FAILED], counts[NO_STATE]) == (0, 0, 0)


def test_the_result_does_not_depend_on_threads(hammer: "ph.Hammer", two: Basins) -> None:
    alone = ph.basins(hammer, period=1.3e-3, threads=1, **PLANE)
    np.testing.assert_array_equal(alone.labels, two.labels)
    np.testing.assert_array_equal(alone.firings, two.firings)
    for one, other in zip(alone.attractors, two.attractors, strict=True):
        np.testing.assert_array_equal(one.states, other.states)


def test_a_sample_of_labels_is_compared_at_a_tenth_of_the_tolerance(two: Basins) -> None:
    assert two.compared == max(two.labels.size // 8, 1)
    assert two.changed == 0
    assert f"0 of {two.compared} labels (0.0 %) change at a tenth of the tolerance" in str(two)
    assert two.to_dataset().attrs["compared"] == two.compared


@pytest.mark.slow
def test_labels_that_hang_on_the_tolerance_are_counted(hammer: "ph.Hammer") -> None:
    """At the finer tolerance every label differs; `changed` counts the sampled cells whose label differs."""
    coarse, fine = (ph.basins(hammer, period=0.98e-3, tolerance=each, **PLANE) for each in (1e-5, 1e-6))
    assert (coarse.labels != fine.labels).all()
    assert coarse.changed == coarse.compared == 9


def test_labels_do_not_depend_on_the_order_of_the_cells(hammer: "ph.Hammer", two: Basins) -> None:
    # The last row alone: whatever attractor is met first, the numbers mean the same.
    last = ph.basins(hammer, period=1.3e-3, x=PLANE["x"], v=(0.9, 1.0, 2))
    np.testing.assert_array_equal(last.labels[-1], two.labels[-1])


def test_a_strange_attractor_is_found_by_its_exponent(hammer: "ph.Hammer") -> None:
    found = ph.basins(hammer, period=1.05e-3, x=(30e-6, 80e-6, 3), v=(-0.4, 0.4, 2))
    (attractor,) = found.attractors
    assert attractor.name == "strange"
    assert attractor.period is None
    assert attractor.exponent > 3.0 * attractor.standard_error
    assert (found.labels == 1).all()


def test_what_does_not_settle_is_undecided(hammer: "ph.Hammer", monkeypatch: pytest.MonkeyPatch) -> None:
    # Without trains that are followed for long, no strange attractor is identified.
    monkeypatch.setattr(attractors, "ATTEMPTS", 0)
    found = ph.basins(hammer, period=1.05e-3, x=(30e-6, 80e-6, 3), v=(-0.4, 0.4, 2), firings=40, rounds=2)
    assert found.attractors == ()
    assert (found.labels == UNDECIDED).all()
    assert found.counts[UNDECIDED] == 6
    assert (found.firings == 80).all()
    assert math.isnan(found.entropy(box=2).entropy)


def test_cells_without_a_state_and_runs_that_end_early(hammer: "ph.Hammer") -> None:
    # The law of the magnet needs x > 0; a fast armature leaves its range.
    short = hammer.replace("magnet.range_max", "290 um")
    found = ph.basins(short, period=1.3e-3, x=(-20e-6, 280e-6, 4), v=(-0.2, 4.0, 2))
    assert (found.labels[:, 0] == NO_STATE).all()
    assert (found.status[:, 0] == "no state").all()
    assert found.labels[1, -1] == FAILED
    assert found.status[1, -1] == "range left"
    share, _ = found.shares
    decided = (found.labels > 0).sum()
    assert share.sum() == pytest.approx(decided / 6)
    assert (found.firings[:, 0] == 0).all()


def test_progress_comes_to_its_end(hammer: "ph.Hammer") -> None:
    told: list[tuple[int, int]] = []
    ph.basins(
        hammer,
        period=1.3e-3,
        x=(40e-6, 60e-6, 3),
        v=(-0.1, 0.1, 3),
        progress=lambda done, total: told.append((done, total)),
    )
    assert told[-1] == (9, 9)


def columns_of(points: np.ndarray) -> Columns:
    """Return trains with given states at the firings."""
    count, length = points.shape[:2]
    return Columns(
        x=points[..., 0],
        v=points[..., 1],
        branch=np.zeros((count, length), np.int8),
        memory=np.zeros((count, length)),
        current=np.zeros((count, length)),
        status=np.full(count, "ok", "U16"),
        last=np.column_stack([points[:, -1], np.tile(AT_REST, (count, 1))]),
    )


def test_orbits_are_known_again_whatever_their_phase(hammer: "ph.Hammer") -> None:
    attractors = Attractors(Regime.of(hammer, period=1e-3), np.ones(4), 1e-9)
    first = np.array([[3.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    other = np.array([[3.0, 0.0], [2.0, 0.0], [1.0, 0.0]])
    trains = np.stack(
        [np.tile(orbit, (6, 1)) for orbit in (first, np.roll(first, 1, axis=0), other, first + 1e-3)]
    )
    # The same points in another order are another orbit.
    assert attractors.judge(columns_of(trains)).tolist() == [0, 0, 1, 0]
    assert attractors.found[0].states[0].tolist() == [1.0, 0.0]
    assert [attractor.period for attractor in attractors.found] == [3, 3]


def slow_and_chaotic(begin: np.ndarray, firings: int, transient: int) -> Columns:
    """Trains of the logistic map, with a second coordinate that forgets its start within 2,000 firings."""
    x, v, points = begin[:, 0].copy(), begin[:, 1].copy(), []
    for firing in range(firings):
        if firing >= transient:
            points.append(np.stack([x, v], axis=1))
        x, v = 3.9 * x * (1.0 - x), 0.9995 * v + 1e-5 * (x - 0.6)
    columns = columns_of(np.stack(points, axis=1))
    columns.last[:, :2] = np.stack([x, v], axis=1)
    return columns


def test_a_strange_attractor_that_is_approached_slowly_is_one(
    hammer: "ph.Hammer", monkeypatch: pytest.MonkeyPatch
) -> None:
    """A thousand firings after its start, each of twelve trains is still far from all other trains."""

    def run(
        regimes: list[Regime], states: np.ndarray, firings: int, transient: int, _effort: object
    ) -> Columns:
        return slow_and_chaotic(states, firings, transient)

    positive = SimpleNamespace(ok=True, smooth=True, value=0.5, standard_error=0.01)
    monkeypatch.setattr(attractors, "run_columns", run)
    monkeypatch.setattr(attractors, "exponents_onward", lambda *_: [positive])
    known = Attractors(Regime.of(hammer, period=1e-3), np.ones(4), 1e-9)
    starts = np.column_stack([np.linspace(0.2, 0.3, 12), np.arange(1.0, 13.0)])
    early = slow_and_chaotic(starts, 200, 100)
    # Where one train has led to a known attractor, the others are waited for.
    assert known.judge(early).tolist() == [0, 0] + 10 * [-1]
    assert [each.name for each in known.found] == ["strange"]
    assert (known.judge(slow_and_chaotic(early.last, 40_000, 39_900)) == 0).all()
    assert len(known.found) == 1


def test_the_entropy_of_one_colour_is_zero() -> None:
    found = basin_entropy(np.ones((8, 8), int), box=4)
    assert (found.entropy, found.boxes, found.boundary_boxes) == (0.0, 4, 0)
    assert math.isnan(found.boundary_entropy)
    assert not found.fractal


def test_the_entropy_of_halves_and_of_a_chessboard() -> None:
    halves = np.repeat([[1, 2]], 4, axis=1)[0] * np.ones((8, 1), int)
    # The boundary between the columns 3 and 4 falls between boxes of 4, and cuts those of 8 in the middle.
    assert basin_entropy(halves, box=4).entropy == 0.0
    whole = basin_entropy(halves, box=8)
    assert whole.entropy == pytest.approx(LN2)
    assert whole.boundary_entropy == pytest.approx(LN2)
    board = np.indices((8, 8)).sum(axis=0) % 2 + 1
    assert basin_entropy(board, box=2).boundary_boxes == 16
    assert basin_entropy(board, box=2).entropy == pytest.approx(LN2)


def test_the_entropy_of_unequal_shares() -> None:
    labels = np.ones((4, 8), int)
    labels[0, 0] = 2
    found = basin_entropy(labels, box=4)
    box = -(15.0 / 16.0) * math.log(15.0 / 16.0) - math.log(1.0 / 16.0) / 16.0
    assert found.entropy == pytest.approx(box / 2.0)
    assert found.boundary_entropy == pytest.approx(box)


def test_more_colours_in_a_box_show_a_fractal_boundary() -> None:
    labels = np.arange(1, 17).reshape(4, 4)
    found = basin_entropy(labels, box=2)
    assert found.boundary_entropy == pytest.approx(math.log(4.0))
    assert found.fractal


def test_cells_that_are_not_known_are_left_out() -> None:
    labels = np.array([[1, 2, 0, 0, 1], [0, -1, -2, 0, 1], [1, 1, 1, 1, 1]])
    found = basin_entropy(labels, box=2)
    # One box with a cell of each, one with none; the last row and column are in no whole box.
    assert (found.boxes, found.boundary_boxes) == (1, 1)
    assert found.entropy == pytest.approx(LN2)
    assert found.left_out == 15 - 2
    nothing = basin_entropy(np.zeros((4, 4), int))
    assert (nothing.boxes, nothing.left_out) == (0, 16)
    assert math.isnan(nothing.entropy)


@given(
    colours=st.integers(1, 5), box=st.integers(1, 4), seed=st.integers(0, 2**32 - 1), rows=st.integers(4, 9)
)
def test_entropies_stay_within_their_bounds(colours: int, box: int, seed: int, rows: int) -> None:
    labels = np.random.default_rng(seed).integers(1, colours + 1, (rows, 8))
    found = basin_entropy(labels, box=box)
    assert 0.0 <= found.entropy <= math.log(min(colours, box * box)) + 1e-12
    if found.boundary_boxes:
        assert found.boundary_entropy * found.boundary_boxes == pytest.approx(found.entropy * found.boxes)
    # Renaming attractors changes nothing.
    renamed = basin_entropy(colours + 1 - labels, box=box)
    assert renamed.entropy == pytest.approx(found.entropy)


def test_a_dataset_and_files_hold_everything(two: Basins, tmp_path: Path) -> None:
    chart = two.to_dataset()
    assert chart["label"].dims == ("v", "x")
    assert chart["label"].attrs["codes"].endswith("0 undecided, 1 period-1, 2 period-1")
    assert chart["share"].values.tolist() == two.shares[0].tolist()
    assert chart.attrs["basin_entropy"] == two.entropy().entropy
    two.save(tmp_path / "basins.nc")
    with xr.open_dataset(tmp_path / "basins.nc", engine="scipy") as kept:
        np.testing.assert_array_equal(kept["label"], two.labels)
    two.save(tmp_path / "basins.csv")
    table = pd.read_csv(tmp_path / "basins.csv", comment="#")
    assert table["label"].tolist() == two.labels.reshape(-1).tolist()
    assert set(two.to_dataframe()["attractor"]) == {"period-1"}
    with refused(None, file="basins.txt"):
        two.save(tmp_path / "basins.txt")
    assert dataclasses.is_dataclass(two)


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({}, "period"),
        ({"period": 1e-3, "rate": 1e3}, "period"),
        ({"period": 1e-3, "x": (1e-5, 2e-5)}, "x"),
        ({"period": 1e-3, "x": (2e-5, 1e-5, 4)}, "x"),
        ({"period": 1e-3, "x": (1e-5, 2e-5, 0)}, "x: number of values"),
        ({"period": 1e-3, "v": (-1.0, "1 kg", 4)}, "v"),
        ({"period": 1e-3, "firings": 3}, "firings"),
        ({"period": 1e-3, "rounds": 0}, "rounds"),
        ({"period": 1e-3, "tolerance": 1.0}, "tolerance"),
        ({"period": 1e-3, "x": (1e-5, 2e-5, 10_000), "v": (-1.0, 1.0, 10_000)}, "cells"),
    ],
)
def test_what_makes_no_sense_is_refused(hammer: "ph.Hammer", options: dict[str, object], key: str) -> None:
    with refused(key):
        ph.basins(hammer, **options)


@pytest.mark.parametrize(
    ("labels", "box", "key"),
    [(np.ones((2, 2)), 1, "labels"), (np.ones(4, int), 1, "labels"), (np.ones((2, 4), int), 3, "box")],
)
def test_entropy_of_what_is_no_plane_is_refused(labels: np.ndarray, box: int, key: str) -> None:
    with refused(key):
        basin_entropy(labels, box=box)


@pytest.mark.slow
def test_near_a_doubling_no_cell_is_left_and_the_orbit_has_its_own_period() -> None:
    hammer = ph.load("hendriks-1983-1")
    # The multiplier is -0.990: states two firings apart agree a thousand firings before those one apart do.
    found = ph.basins(hammer, period=1.05e-3, x=(30e-6, 260e-6, 4), v=(-1.0, 1.0, 4))
    assert found.counts[0] == 0
    assert [attractor.name for attractor in found.attractors] == ["period-1", "period-2"]
    ((x, v),) = found.attractors[0].states.tolist()
    after = ph.strobe(hammer, period=1.05e-3, points=2, transient=3000, state=(x, v), verdict=False)
    assert after.x[0] == pytest.approx(x, abs=1e-9)


def test_the_uncertainty_exponent_is_one_for_a_straight_boundary() -> None:
    labels = np.ones((64, 64), np.int64)
    labels[:, 30:] = 2
    assert uncertainty_exponent(labels) == pytest.approx(1.0, abs=1e-12)
    # Labels of a coin: as uncertain at any distance.
    assert abs(uncertainty_exponent(1 + np.random.default_rng(1).integers(0, 2, (128, 128)))) < 0.02
    assert math.isnan(uncertainty_exponent(np.ones((64, 64), np.int64)))
