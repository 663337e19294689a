"""Lanes: the results of a member depend on the member only, to the last bit."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from tests import hammers
from tests.ensembles import TIMES, Members, differing

import printhammer as ph
from printhammer.kernel.lanes import layout as lane_layout
from printhammer.run import ensemble_group
from printhammer.run.ensemble import DISPLAY_TOLERANCE, EnsembleResult


@pytest.fixture(scope="module")
def members() -> Members:
    return Members(0)


@pytest.fixture(scope="module")
def whole(members: Members) -> EnsembleResult:
    """Return the results of all members, in one thread."""
    return members.run(threads=1, engine="lanes")


def test_the_members_are_many_and_different(members: Members, whole: EnsembleResult) -> None:
    assert len(members.hammers) > 3 * lane_layout.LANES
    assert whole.ok.sum() > 0.9 * len(members.hammers)
    assert not whole.ok.all()
    assert whole.dots is not None
    struck, fired = whole.dots.struck.sum(), whole.dots.fired.sum()
    assert 0.2 * fired < struck < fired
    assert np.isnan(whole.dots.contact_time[whole.dots.struck]).any()
    assert whole.strobes is not None
    assert {-1, 0, 1, 2, 5} <= set(np.unique(whole.strobes.branch))


@pytest.mark.parametrize("threads", [2, 3])
def test_any_number_of_threads(members: Members, whole: EnsembleResult, threads: int) -> None:
    assert differing(whole, members.run(threads=threads, engine="lanes")) == []


@pytest.mark.parametrize("seed", [0, 1])
def test_any_order(members: Members, whole: EnsembleResult, seed: int) -> None:
    order = np.random.default_rng(seed).permutation(len(members.hammers))
    assert differing(whole, members.run(order, threads=2, engine="lanes"), order) == []


@pytest.mark.parametrize("chunk", [7, 16, 129, 399])
def test_any_chunks(members: Members, whole: EnsembleResult, chunk: int) -> None:
    # A small chunk is not run for all members.
    count = min(len(members.hammers), 20 * chunk)
    for first in range(0, count, chunk):
        which = np.arange(first, min(first + chunk, count))
        assert differing(whole, members.run(which, engine="lanes"), which) == []


def test_every_member_alone(members: Members, whole: EnsembleResult) -> None:
    for i in range(0, len(members.hammers), 3):
        assert differing(whole, members.run(np.array([i]), engine="lanes", threads=1), [i]) == []


def test_the_same_member_many_times(members: Members, whole: EnsembleResult) -> None:
    """A hundred equal members in step, and one of them among different members."""
    for i in (1, 14, 203):
        which = np.full(2 * lane_layout.LANES + 3, i)
        assert differing(whole, members.run(which, engine="lanes"), which) == []
        which[::2] = np.arange(len(which[::2]))
        assert differing(whole, members.run(which, engine="lanes"), which) == []


@pytest.mark.parametrize(
    "left_out",
    [
        ("dots",),
        ("strobes",),
        ("times",),
        ("dots", "strobes"),
        ("strobes", "times"),
        ("dots", "strobes", "times"),
    ],
)
def test_what_is_kept_changes_nothing(
    members: Members, whole: EnsembleResult, left_out: tuple[str, ...]
) -> None:
    options: dict[str, Any] = {name: False if name == "dots" else None for name in left_out}
    found = members.run(engine="lanes", **options)
    assert differing(whole, found) == []


def test_other_strobes_and_times_change_nothing(members: Members, whole: EnsembleResult) -> None:
    coarse = members.run(times=TIMES[::7], strobes="firings", engine="lanes")
    assert coarse.x is not None
    assert whole.x is not None
    np.testing.assert_array_equal(coarse.x, whole.x[:, ::7])
    skip = ("x", "strobes.t", "strobes.x", "strobes.v", "strobes.branch", "strobes.memory")
    assert differing(whole, coarse, skip=skip) == []
    assert whole.strobes is not None
    # Every other strobe of a member is what it was among all.
    fewer = members.run(strobes=[moments[::2] for moments in members.strobes], engine="lanes")
    assert fewer.strobes is not None
    for name in ("x", "v", "branch", "memory"):
        for i, moments in enumerate(members.strobes):
            some = len(moments[::2])
            np.testing.assert_array_equal(
                getattr(fewer.strobes, name)[i, :some],
                getattr(whole.strobes, name)[i, : len(moments)][::2],
            )


@pytest.mark.parametrize("waste", [np.nan, np.inf, -1.0, 1e300, 5e-324, "random"])
def test_nothing_is_read_that_was_not_written(
    members: Members, whole: EnsembleResult, monkeypatch: pytest.MonkeyPatch, waste: Any
) -> None:
    """Arbitrary contents of the working space, such as stale numbers of other members, have no effect."""
    rng = np.random.default_rng(5)

    class Full:
        """Replacement for NumPy whose new arrays are filled with `waste`."""

        def __getattr__(self, name: str) -> Any:
            return getattr(np, name)

        @staticmethod
        def zeros(shape: Any, dtype: Any = np.float64) -> npt.NDArray[Any]:
            room = np.zeros(shape, dtype)
            if dtype == np.float64:
                room[...] = rng.normal(1.0, 3.0, room.shape) if waste == "random" else waste
            else:
                room[...] = 3
            return room

        empty = zeros

    order = rng.permutation(len(members.hammers))
    ensemble = members.ensemble(order)
    assert ensemble.groups
    monkeypatch.setattr(ensemble_group, "np", Full())
    found = ensemble.run(
        dots=True, strobes=[members.strobes[i] for i in order], times=TIMES, engine="lanes", threads=1
    )
    assert differing(whole, found, order) == []


def test_one_hammer_and_waveform_for_all_is_one_of_many(members: Members, whole: EnsembleResult) -> None:
    """The faster code for uniform ensembles gives bit-identical results."""
    for hammer in {id(h): h for h in members.hammers}.values():
        which = np.array([i for i, h in enumerate(members.hammers) if h is hammer])
        # Same scales as well, which the speed at the start is part of.
        for i in which[:2]:
            alike = which[members.states[which, 1] == members.states[i, 1]]
            assert members.ensemble(alike).groups[0].uniform
            assert differing(whole, members.run(alike, engine="lanes"), alike) == []


def assert_no_gaps(result: EnsembleResult) -> None:
    """Check that results are finite up to the time that a member reached, and NaN beyond."""
    assert np.isfinite(result.reached).all()
    assert result.x is not None
    np.testing.assert_array_equal(np.isnan(result.x), result.reached[:, np.newaxis] < TIMES)
    assert result.strobes is not None
    there = result.strobes.t <= result.reached[:, np.newaxis]
    for name in ("x", "v", "memory"):
        np.testing.assert_array_equal(np.isfinite(getattr(result.strobes, name)), there)
    np.testing.assert_array_equal(result.strobes.branch >= 0, there)
    assert result.dots is not None
    for name in ("flight_time", "impact_speed", "peak_force", "indentation"):
        np.testing.assert_array_equal(np.isfinite(getattr(result.dots, name)), result.dots.struck)


@pytest.mark.parametrize("engine", ["lanes", "plain"])
@pytest.mark.parametrize("tolerance", [1e-14, 2e-11, DISPLAY_TOLERANCE, 1e-5])
def test_there_are_no_gaps(members: Members, engine: Any, tolerance: float) -> None:
    assert_no_gaps(members.run(engine=engine, tolerance=tolerance))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10, 12 + 2 * hammers.DRAWS))
def test_thousands_of_members(seed: int) -> None:
    """Thousands of other members, many of which leave the lanes: halves in any order, in two threads."""
    some = Members(seed, 500, kinds=12, strange=seed % 4)
    for tolerance in (2e-11, DISPLAY_TOLERANCE):
        whole = some.run(engine="lanes", threads=1, tolerance=tolerance)
        assert_no_gaps(whole)
        half = np.random.default_rng(seed).permutation(500)[:250]
        assert differing(whole, some.run(half, engine="lanes", threads=2, tolerance=tolerance), half) == []
        plain = some.run(engine="plain", tolerance=tolerance)
        np.testing.assert_array_equal(whole.status, plain.status)


@pytest.mark.slow
def test_the_company_of_other_waveforms_changes_nothing() -> None:
    """Each kind of waveform has a separate kernel, in every ensemble."""
    some = Members(2, 70)
    shapes = hammers.waveforms(1.2, "current")
    for i, name in enumerate(shapes):
        for j in range(i, len(some.drives), len(shapes)):
            rule = "replace" if j % 4 == 1 else "add"
            some.drives[j] = ph.PulseTrain(shapes[name], at=some.drives[j].times, overlap=rule)
    whole = some.run(engine="lanes")
    for i in range(len(shapes)):
        which = np.arange(i, len(some.drives), len(shapes))
        assert differing(whole, some.run(which, engine="lanes"), which) == []
        assert differing(whole, some.run(which[:1], engine="lanes"), which[:1]) == []
