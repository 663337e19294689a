import math

import numpy as np
import pytest
from scipy.stats import spearmanr
from studies.reconstruction.family.conclusions import QUANTITIES
from studies.reconstruction.family.robustness import STATEMENTS, decisive_constants, robustness

COUNT = 24


def family(**other: list[float | None]) -> tuple[list[dict], list[dict[str, float]]]:
    """Return a family whose safe rate varies with the damping; all other conclusions are constant."""
    random = np.random.default_rng(3)
    constants = [
        {"mass": float(random.uniform(1.0, 2.0)), "backstop.damping": 1.0 + number, "platen": 1.0}
        for number in range(COUNT)
    ]
    steady = {
        "safe_rate_Hz": 700.0,
        "chaos_onset_s": 1.25e-3,
        "flight_time_spread_s": 150e-6,
        "engraved_limit_Hz": 800.0,
        "dot_matrix_limit_Hz": None,
        "energy_per_dot_J": 1.2e-3,
        "pack_loss_J": 0.5e-3,
        "backstop_loss_J": 0.7e-3,
        "settle_out_s": 0.9e-3,
        "print_force_N": 22.2,
    }
    assert list(steady) == list(QUANTITIES)
    rows = [
        {**steady, "safe_rate_Hz": 500.0 + number, **{name: values[number] for name, values in other.items()}}
        for number in range(COUNT)
    ]
    return rows, constants


def test_what_varies_little_is_robust() -> None:
    told = robustness(*family())
    assert told["safe_rate_Hz"]["robust"]
    assert (told["safe_rate_Hz"]["low"], told["safe_rate_Hz"]["high"]) == (500.0, 523.0)
    assert told["safe_rate_Hz"]["median"] == 511.5
    assert told["safe_rate_Hz"]["spread"] == pytest.approx(23.0 / 511.5)
    assert told["energy_per_dot_J"]["spread"] == 0.0
    assert "by choice" in told["energy_per_dot_J"]["text"]
    assert "by choice" not in told["safe_rate_Hz"]["text"]


def test_what_varies_is_not_and_the_constant_that_decides_is_named() -> None:
    told = robustness(*family(safe_rate_Hz=[900.0 - 20.0 * number for number in range(COUNT)]))
    entry = told["safe_rate_Hz"]
    assert not entry["robust"]
    assert entry["correlations"]["backstop.damping"] == pytest.approx(-1.0)
    assert "platen" not in entry["correlations"]
    assert "most with backstop.damping (rank correlation -1.00)" in entry["text"]
    random = np.random.default_rng(8).uniform(400.0, 900.0, COUNT).tolist()
    assert "no single constant decides" in robustness(*family(safe_rate_Hz=random))["safe_rate_Hz"]["text"]


def test_what_some_members_do_not_have_is_not_robust() -> None:
    onsets: list[float | None] = [1.25e-3] * (COUNT - 2) + [None, None]
    told = robustness(*family(chaos_onset_s=onsets))
    assert not told["chaos_onset_s"]["robust"]
    assert told["chaos_onset_s"]["known"] == COUNT - 2
    assert "2 members do not have it" in told["chaos_onset_s"]["text"]
    assert not told["prints_badly_before_chaos"]["robust"]
    assert told["prints_badly_before_chaos"]["held"] == COUNT - 2
    nobody = told["dot_matrix_limit_Hz"]
    assert (nobody["low"], nobody["high"], nobody["robust"]) == (None, None, True)
    assert "no member" in nobody["text"]


def test_statements_are_counted() -> None:
    told = robustness(*family(flight_time_spread_s=[190e-6 + 1e-6 * number for number in range(COUNT)]))
    assert told["too_much_for_engraved_type"]["robust"]
    assert told["too_much_for_engraved_type"]["text"].endswith(f"true of all {COUNT} members.")
    matrix = told["too_much_for_dot_matrix"]
    assert not matrix["robust"]
    assert matrix["held"] == COUNT - 11
    assert (matrix["low"], matrix["high"]) == pytest.approx((-10e-6, 13e-6))
    assert told["not_settled_at_1_kHz"]["robust"]
    assert told["not_settled_at_1_kHz"]["text"].endswith("true of no member.")
    assert told["looks_settled_but_is_not"]["low"] == pytest.approx(1.0 / 0.9e-3 - 523.0)
    assert set(told) == {*QUANTITIES, *STATEMENTS}


@pytest.mark.parametrize("count", [6, 12, 24, 100])
def test_significance_is_that_of_a_rank_correlation_among_several(count: int) -> None:
    random = np.random.default_rng(count)
    target = random.normal(size=count)
    columns = {f"k{number}": target * number / 6.0 + random.normal(size=count) for number in range(12)}
    found = {key: spearmanr(values, target) for key, values in columns.items()}
    correlations = {key: float(row.statistic) for key, row in found.items()}
    expected = {key for key, row in found.items() if row.pvalue < 0.05 / len(columns)}
    decisive = decisive_constants(correlations, count)
    assert set(decisive) == expected
    assert list(map(abs, decisive.values())) == sorted(map(abs, decisive.values()), reverse=True)
    assert all(math.isfinite(value) for value in decisive.values())


def test_too_few_members_decide_nothing() -> None:
    assert decisive_constants({"mass": 1.0}, 3) == {}
    assert decisive_constants({}, 24) == {}
