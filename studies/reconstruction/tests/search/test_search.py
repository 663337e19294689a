"""Tests of the search: determined by its seed, and resumed from an existing log."""

import itertools
import json
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from studies.reconstruction.search import evaluation
from studies.reconstruction.search import search as module
from studies.reconstruction.search.explorer import CHEAP, Explorer
from studies.reconstruction.search.search import Plan, known_starts, search, starts_of
from studies.reconstruction.search.space import VARIABLES

from printhammer.errors import InputError

PLAN = Plan("all", seed=3, sample=16)
SAMPLED = 16
"""Number of points in the initial sample."""
ROUND = 12
"""Number of points in each later round; the log grows by whole rounds."""

SHORT, LONG = SAMPLED + 2 * ROUND, SAMPLED + 4 * ROUND


@pytest.fixture(autouse=True)
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    small = {"ISLANDS": 2, "POPULATION": 4, "EXPLORED": 4, "PATIENCE": 3, "_TOGETHER": 8}
    for name, value in small.items():
        monkeypatch.setattr(module, name, value)


@pytest.fixture
def bowl(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Replace the loss by a quadratic bowl; return the list of batch sizes."""
    computed: list[int] = []

    def scored(points: list[Any], aim: str, _pool: Any, _shape: str) -> list[dict[str, Any]]:
        computed.append(len(points))
        return [
            {
                "point": [float(share) for share in point],
                "total": float(np.sum((point - 0.7) ** 2)),
                "losses": {},
                "measured": {"aim": aim},
                "constants": {"mass": 1.0 + float(point[0])},
            }
            for point in points
        ]

    monkeypatch.setattr(module, "scored", scored)
    return computed


def run(path: Path, count: int, plan: Plan = PLAN, **options: Any) -> list[dict[str, Any]]:
    return list(itertools.islice(search(plan, path, **options), count))


def test_the_same_seed_writes_the_same_bytes(bowl: list[int], tmp_path: Path) -> None:
    rows = run(tmp_path / "a.jsonl", LONG)
    run(tmp_path / "b.jsonl", LONG)
    run(tmp_path / "c.jsonl", LONG, Plan("all", seed=4, sample=16))
    first, same, other = ((tmp_path / f"{name}.jsonl").read_bytes() for name in "abc")
    assert first == same != other
    heading, *lines = first.decode().splitlines()
    assert json.loads(heading)["seed"] == 3
    assert [json.loads(line) for line in lines] == rows
    assert sum(bowl) == 3 * LONG


def test_aims_have_searches_of_their_own(bowl: list[int], tmp_path: Path) -> None:
    stated = run(tmp_path / "a.jsonl", 16, Plan("stated", seed=3, sample=16))
    assert stated[0]["measured"] == {"aim": "stated"}
    assert stated[0]["point"] != run(tmp_path / "b.jsonl", 16)[0]["point"]
    assert bowl


def test_waveforms_have_searches_of_their_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shapes: list[str] = []

    def scored(points: list[Any], _aim: str, _pool: Any, shape: str) -> list[dict[str, Any]]:
        shapes.append(shape)
        return [{"point": point.tolist(), "total": 1.0, "constants": {}} for point in points]

    monkeypatch.setattr(module, "scored", scored)
    plain = run(tmp_path / "a.jsonl", SAMPLED)
    other = run(tmp_path / "b.jsonl", SAMPLED, Plan("all", seed=3, sample=16, shape="half-sine"))
    assert set(shapes) == {"rectangle", "half-sine"}
    assert plain[0]["point"] != other[0]["point"]
    with pytest.raises(InputError, match=r"shape = .rectangle., expected .half-sine."):
        run(tmp_path / "a.jsonl", SAMPLED, Plan("all", seed=3, sample=16, shape="half-sine"))


def test_known_hammers_are_starts() -> None:
    starts = known_starts("buzz")
    assert len(starts) > 10
    assert all(len(point) == len(VARIABLES) for point in starts)
    with pytest.raises(InputError, match="aim = 'stated', expected no start"):
        known_starts("stated")


def test_it_finds_the_bottom(bowl: list[int], tmp_path: Path) -> None:
    rows = run(tmp_path / "a.jsonl", 1200)
    least = [min(row["total"] for row in rows[:count]) for count in (16, 1200)]
    assert least[1] < 0.05 * least[0]
    assert all(0.0 <= share <= 1.0 for row in rows for share in row["point"])
    # Islands begin anew, so that no point comes for ever.
    assert len({tuple(row["point"]) for row in rows}) > 0.99 * len(rows)
    assert bowl


def test_the_sample_is_spread_evenly(bowl: list[int], tmp_path: Path) -> None:
    points = np.array([row["point"] for row in run(tmp_path / "a.jsonl", 16)])
    assert points.shape == (16, len(VARIABLES))
    # A scrambled Sobol sequence has one of 16 points in each sixteenth of each range.
    assert (np.sort(np.floor(points * 16), axis=0) == np.arange(16)[:, np.newaxis]).all()
    assert bowl


@pytest.mark.parametrize("length", [0, 1, 40, -1])
def test_a_search_that_was_stopped_in_its_heading_begins_anew(
    bowl: list[int], tmp_path: Path, length: int
) -> None:
    path = tmp_path / "a.jsonl"
    run(path, SAMPLED)
    whole = path.read_bytes()
    path.write_bytes(whole.partition(b"\n")[0][:length])
    run(path, SAMPLED)
    assert path.read_bytes() == whole
    assert bowl


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"notes", "expected JSON lines of a search"),
        (b"some\nnotes", "expected JSON lines of a search"),
        (b"[1]\n{}", "expected JSON lines of a search, each an object"),
        (b"{}\nnotes", "the log of another search: format = null, expected 1"),
        (b"\xff\xfe", "the log cannot be read"),
    ],
)
def test_what_is_no_log_stays_as_it_is(bowl: list[int], tmp_path: Path, content: bytes, said: str) -> None:
    path = tmp_path / "notes.txt"
    path.write_bytes(content)
    with pytest.raises(InputError, match=rf"notes\.txt: {said}"):
        run(path, SAMPLED)
    assert path.read_bytes() == content
    assert bowl == []


def test_a_log_that_cannot_be_written_is_told(bowl: list[int], tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the log cannot be written"):
        run(tmp_path / "none" / "a.jsonl", SAMPLED)
    with pytest.raises(InputError, match="the log cannot be read"):
        run(tmp_path, SAMPLED)
    assert bowl == []


def test_a_missing_package_is_told_before_anything_is_done(
    bowl: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "cmaes", None)
    with pytest.raises(InputError, match=r"the search needs cmaes, .* 'printhammer\[studies\]'"):
        run(tmp_path / "a.jsonl", SAMPLED)
    assert bowl == []
    assert not (tmp_path / "a.jsonl").exists()


@pytest.mark.parametrize("share", [0.0, 0.1, 0.37, 0.5, 0.72, 0.9999])
def test_a_search_goes_on_where_it_was_stopped(bowl: list[int], tmp_path: Path, share: float) -> None:
    path = tmp_path / "a.jsonl"
    run(path, LONG)
    whole = path.read_bytes()
    heading = whole.index(b"\n") + 1
    # The cut usually falls in the middle of a line.
    cut = whole[: heading + round(share * (len(whole) - heading))]
    path.write_bytes(cut)
    bowl.clear()
    run(path, LONG)
    assert path.read_bytes() == whole
    there = cut.count(b"\n") - 1
    assert sum(bowl) == LONG - there


def test_going_on_beyond_a_whole_log(bowl: list[int], tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    short = run(path, SHORT)
    long = run(path, LONG)
    assert long[: len(short)] == short
    assert long == run(tmp_path / "b.jsonl", LONG)
    assert path.read_bytes() == (tmp_path / "b.jsonl").read_bytes()
    assert bowl


def test_what_interrupts_leaves_the_log_as_far_as_it_was(
    bowl: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.jsonl"
    whole = run(path, LONG)
    wanted = path.read_bytes()
    path.unlink()
    plain = module.scored
    calls = iter(range(100))

    def stopped(points: list[Any], aim: Any, pool: Any, shape: Any) -> list[dict[str, Any]]:
        if next(calls) == 3:
            raise KeyboardInterrupt
        return plain(points, aim, pool, shape)

    monkeypatch.setattr(module, "scored", stopped)
    with pytest.raises(KeyboardInterrupt):
        run(path, LONG)
    assert wanted.startswith(path.read_bytes())
    assert path.read_bytes().count(b"\n") == 1 + SAMPLED + ROUND
    assert run(path, LONG) == whole
    assert path.read_bytes() == wanted
    assert bowl


def test_progress_tells_the_best_so_far(bowl: list[int], tmp_path: Path) -> None:
    told: list[tuple[int, float]] = []
    rows = run(
        tmp_path / "a.jsonl",
        SHORT,
        tell=lambda count, least, row: told.append((count, least)) or row["total"],
    )
    assert [count for count, _ in told] == [8, SAMPLED, SAMPLED + ROUND, SHORT]
    for count, least in told:
        assert least == min(row["total"] for row in rows[:count])
    assert bowl


@pytest.mark.parametrize(
    ("plan", "said"),
    [
        (Plan("all", seed=4, sample=16), "seed = 3, expected 4"),
        (Plan("stated", seed=3, sample=16), 'aim = "all", expected "stated"'),
        (Plan("all", seed=3, sample=32), "sample = 16, expected 32"),
        (Plan("all", seed=3, sample=16, starts=((0.5,) * len(VARIABLES),)), r"starts = \[\], expected"),
    ],
)
def test_the_log_of_another_search_is_refused(bowl: list[int], tmp_path: Path, plan: Plan, said: str) -> None:
    path = tmp_path / "a.jsonl"
    run(path, SAMPLED)
    before = path.read_bytes()
    with pytest.raises(InputError, match=rf"a\.jsonl: the log of another search: {said}") as error:
        run(path, SAMPLED, plan)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 400
    assert path.read_bytes() == before
    assert bowl


def test_a_search_on_stated_claims_begins_from_none_that_others_led(bowl: list[int], tmp_path: Path) -> None:
    run(tmp_path / "a.jsonl", SAMPLED)
    run(tmp_path / "b.jsonl", SAMPLED, Plan("stated", seed=3, sample=16))
    assert len(starts_of(tmp_path / "b.jsonl", "stated", 2)) == 2
    assert len(starts_of(tmp_path / "b.jsonl", "all", 2)) == 2
    with pytest.raises(InputError, match="aim = 'all', expected the log of a search on stated claims"):
        starts_of(tmp_path / "a.jsonl", "stated")
    assert bowl


def test_other_weights_or_ranges_are_another_search(
    bowl: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.jsonl"
    run(path, SAMPLED)
    monkeypatch.setitem(evaluation.WEIGHTS["all"], "settle_out", 3.0)
    with pytest.raises(InputError, match="the log of another search"):
        run(path, SAMPLED)
    assert bowl


def test_a_candidate_that_is_not_of_this_search_is_told(bowl: list[int], tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    run(path, SHORT)
    lines = path.read_text().splitlines(keepends=True)
    lines[5], lines[6] = lines[6], lines[5]
    path.write_text("".join(lines))
    with pytest.raises(InputError, match="candidate 5 is not the one of this search"):
        run(path, SHORT)
    assert bowl


def test_a_broken_line_in_the_middle_is_told(bowl: list[int], tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    run(path, SAMPLED)
    path.write_text(path.read_text() + "{\n")
    with pytest.raises(InputError, match="expected JSON lines of a search"):
        run(path, SAMPLED)
    assert bowl


def test_points_of_another_search_come_first(bowl: list[int], tmp_path: Path) -> None:
    rows = run(tmp_path / "a.jsonl", LONG)
    starts = starts_of(tmp_path / "a.jsonl", "all", 3)
    best = min(rows, key=lambda row: float(row["total"]))
    assert starts[0] == tuple(best["point"])
    plan = Plan("all", seed=5, sample=16, starts=starts)
    found = run(tmp_path / "b.jsonl", 3 + SAMPLED, plan)
    assert [tuple(row["point"]) for row in found[:3]] == list(starts)
    assert [row["point"] for row in found[3:]] == [
        row["point"] for row in run(tmp_path / "c.jsonl", SAMPLED, Plan("all", seed=5, sample=16))
    ]
    assert bowl


def inside(point: Any, total: float = 0.0, **losses: float) -> dict[str, Any]:
    met = dict.fromkeys(CHEAP, 0.0)
    return {"point": list(point), "total": total, "losses": met | losses, "constants": {"mass": 1.0}}


def test_the_explorer_stays_in_the_region_it_knows() -> None:
    rng = np.random.default_rng(1)
    explorer = Explorer(evaluation.WEIGHTS["all"], rng)
    # A narrow region: the first three coordinates are equal.
    points = [np.full(len(VARIABLES), 0.5) for _ in range(40)]
    for number, point in enumerate(points):
        point[:3] = 0.3 + 0.01 * number
    far = [inside(np.full(len(VARIABLES), 0.9), settle_out=1.0) for _ in range(40)]
    explorer.note([*far, *(inside(point) for point in points)])
    asked = np.array(explorer.ask(200))
    assert np.abs(asked[:, 3:] - 0.5).max() < 0.05
    assert np.abs(asked[:, 0] - asked[:, 1]).max() < 0.05
    assert np.ptp(asked[:, 0]) > 0.3


def test_the_explorer_keeps_to_the_ranges() -> None:
    explorer = Explorer(evaluation.WEIGHTS["stated"], np.random.default_rng(2))
    corners = np.random.default_rng(3).integers(0, 2, (40, len(VARIABLES))).astype(float)
    explorer.note([inside(point) for point in corners])
    asked = np.array(explorer.ask(200))
    assert asked.min() >= 0.0
    assert asked.max() <= 1.0


@pytest.fixture
def threads() -> Iterator[ThreadPoolExecutor]:
    with ThreadPoolExecutor(3) as pool:
        yield pool


def test_rows_come_in_the_order_of_the_points(
    monkeypatch: pytest.MonkeyPatch, threads: ThreadPoolExecutor
) -> None:
    monkeypatch.setattr(evaluation, "PIECE", 3)
    monkeypatch.setattr(
        evaluation,
        "rows",
        lambda points, aim, shape: [{"point": p, "aim": aim, "shape": shape} for p in points],
    )
    points = [np.array([float(number)]) for number in range(10)]
    found = evaluation.scored(points, "all", threads)
    assert [row["point"] for row in found] == points
    assert found == evaluation.scored(points, "all", None)
    assert evaluation.scored([], "all", None) == []


def test_hammers_are_searched_stopped_and_gone_on_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The log is cut in the middle of a block that is evaluated together.
    monkeypatch.setattr(evaluation, "PIECE", 4)
    path = tmp_path / "a.jsonl"
    run(path, SAMPLED + ROUND)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    run(path, SAMPLED + ROUND)
    assert path.read_bytes() == whole


@pytest.mark.slow
def test_one_process_and_two_write_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(evaluation, "PIECE", 4)
    plan = Plan("stated", seed=2, sample=32)
    run(tmp_path / "a.jsonl", 32 + ROUND, plan)
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        run(tmp_path / "b.jsonl", 32 + ROUND, plan, pool=pool)
    assert (tmp_path / "a.jsonl").read_bytes() == (tmp_path / "b.jsonl").read_bytes()
