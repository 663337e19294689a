from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest
from tests.errors import refused
from tests.report.reconstruction_files import changed, write

from printhammer.report.reconstruction.results import FILES, Results, Share, shipped_results


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
    ("fault", "key"),
    [
        ({"base_rates": []}, None),
        (changed("base_rates", "format", to=2), "format"),
        (
            changed("base_rates", "claims", "settle_out", "holds", to=901),
            "claims.settle_out",
        ),
        (
            changed("base_rates", "claims", "settle_out", "holds", to=-1),
            "claims.settle_out.holds",
        ),
        (
            changed("base_rates", "claims", to={"setle_out": {"measured": 1, "holds": 1}}),
            "claims.setle_out",
        ),
        (changed("predictions", "extra", to=1), "extra"),
        (changed("predictions", "claims", "settle_out", "kind", to="odd"), "claims.settle_out.kind"),
        (changed("search", "core_hours", to="long"), "core_hours"),
        (changed("search", "searches", to=[]), "searches"),
        (changed("search", "searches", 1, "aim", to="shape"), "searches[2].aim"),
        (
            changed("search", "failing", "release_margin", "best", "costs", to=["x"]),
            "failing.release_margin.best.costs[1]",
        ),
        (changed("family", "hammers", to=[]), "hammers"),
        (
            changed("family", "hammers", 0, "verdicts", to={"settle_out": "odd"}),
            "hammers[1].verdicts.settle_out",
        ),
    ],
)
def test_corrupt_files_are_told_in_one_sentence(
    tmp_path: Path, fault: dict[str, Any], key: str | None
) -> None:
    (name,) = fault
    with refused(key) as error:
        Results(write(tmp_path, **fault)).check()
    assert f"{name}.json: " in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("content", "key"),
    [
        (b"{", None),
        (b'{"format": NaN}', None),
        (b"\xff\xfe", None),
    ],
)
def test_files_that_are_no_json(tmp_path: Path, content: bytes, key: str | None) -> None:
    (tmp_path / "search.json").write_bytes(content)
    with refused(key, file="search.json"):
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
