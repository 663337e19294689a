from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest
from tests.report.reconstruction_files import changed, write

from printhammer.errors import InputError
from printhammer.report.reconstruction.results import FILES, Results, shipped_results
from printhammer.report.reconstruction.shares import Share


def test_all_that_is_there_is_read(tmp_path: Path) -> None:
    found = Results(write(tmp_path))
    found.check()
    assert found.base_rates is not None
    assert found.base_rates.share("settle_out") == Share(900, 9)
    # Never measured, and never heard of.
    assert found.base_rates.share("poincare") is None
    assert found.base_rates.share("geometry") is None
    assert found.base_rates.panels == {"1.35 ms": Share(500, 100)}
    assert found.predictions is not None
    assert found.predictions.share("settle_out") == Share(20, 3)
    assert found.search is not None
    assert [(one.aim, one.seed, one.candidates) for one in found.search.searches] == [
        ("stated", 7, 4000),
        ("all", 8, 9000),
    ]
    assert found.family is not None
    assert found.family.hammers[0].panels == 9


@pytest.mark.parametrize("name", FILES)
def test_what_is_absent_is_none(tmp_path: Path, name: str) -> None:
    found = Results(write(tmp_path, **{name: None}))
    found.check()
    assert [key for key in FILES if getattr(found, key) is None] == [name]


def test_what_ships_can_be_read() -> None:
    shipped_results().check()


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ({"base_rates": []}, "base_rates.json: expected an object"),
        (changed("base_rates", "format", to=2), "format = 2: expected 1"),
        (
            changed("base_rates", "claims", "settle_out", "holds", to=901),
            "claims.settle_out: expected no more",
        ),
        (
            changed("base_rates", "claims", "settle_out", "holds", to=-1),
            "claims.settle_out.holds = -1: expected",
        ),
        (
            changed("base_rates", "claims", to={"setle_out": {"measured": 1, "holds": 1}}),
            "setle_out.*: expected the name",
        ),
        (changed("predictions", "extra", to=1), "the key extra is not known"),
        (changed("predictions", "claims", "settle_out", "kind", to="odd"), "kind = 'odd': expected 'stated'"),
        (changed("search", "core_hours", to="long"), "core_hours = 'long': expected a valid number"),
        (changed("search", "searches", to=[]), "search.json: searches: expected"),
        (changed("search", "searches", 1, "aim", to="shape"), "searches.*aim = 'shape': expected 'stated'"),
        (
            changed("search", "failing", "release_margin", "best", "costs", to=["x"]),
            "costs.* = 'x': expected the name",
        ),
        (changed("family", "hammers", to=[]), "family.json: hammers: expected"),
        (
            changed("family", "hammers", 0, "verdicts", to={"settle_out": "odd"}),
            "settle_out = 'odd': expected",
        ),
    ],
)
def test_corrupt_files_are_told_in_one_sentence(tmp_path: Path, fault: dict[str, Any], told: str) -> None:
    (name,) = fault
    with pytest.raises(InputError, match=told) as error:
        Results(write(tmp_path, **fault)).check()
    assert f"{name}.json: " in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"{", "expected JSON"),
        (b'{"format": NaN}', "NaN is no number of JSON"),
        (b"\xff\xfe", "cannot be read"),
    ],
)
def test_files_that_are_no_json(tmp_path: Path, content: bytes, told: str) -> None:
    (tmp_path / "search.json").write_bytes(content)
    with pytest.raises(InputError, match=f"search.json: .*{told}"):
        Results(tmp_path).check()


@given(st.integers(1, 10**6).flatmap(lambda n: st.tuples(st.just(n), st.integers(0, n))))
def test_intervals_of_shares_are_those_of_wilson(share: tuple[int, int]) -> None:
    measured, holds = share
    wanted = binomtest(holds, measured).proportion_ci(0.95, method="wilson")
    low, high = Share(measured, holds).interval
    assert low == pytest.approx(wanted.low, rel=1e-9, abs=1e-12)
    assert high == pytest.approx(wanted.high, rel=1e-9, abs=1e-12)
    assert 0.0 <= low <= holds / measured <= high <= 1.0
    assert low < high
