"""Tests of the Pareto front of judged hammers."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from studies.reconstruction.judging.front import front
from studies.reconstruction.judging.judged import FIGURE_11, STATED

from printhammer.claims import claims
from printhammer.errors import InputError

OTHERS = [name for name in claims() if name != FIGURE_11]


def row(panels: int, held: int) -> dict[str, Any]:
    verdicts = {name: number < held for number, name in enumerate(OTHERS)}
    return {"panels": panels, "verdicts": {**verdicts, FIGURE_11: panels == 12}}


@given(st.lists(st.tuples(st.integers(0, 12), st.integers(0, len(OTHERS))), min_size=1, max_size=20))
def test_nothing_beats_what_is_on_the_front_and_something_all_else(pairs: list[tuple[int, int]]) -> None:
    found = front([row(*pair) for pair in pairs])
    assert list(zip(found.panels, found.others, strict=True)) == pairs
    for pair, on_front in zip(pairs, found.on_front, strict=True):
        beaten = any(p >= pair[0] and o >= pair[1] and (p, o) != pair for p, o in pairs)
        assert on_front == (not beaten)


def test_only_hammers_with_every_claim_judged_count() -> None:
    short = row(9, 20)
    del short["verdicts"]["settle_out"]
    found = front([short, {**row(3, 4), "panels": None}, row(6, len(OTHERS))], 7200.0)
    assert found.candidate.tolist() == [3]
    assert found.stated.all()
    assert found.buzzes.all()
    assert found.core_time == 7200.0
    with pytest.raises(InputError, match="--every-claim"):
        front([short])


def test_all_other_stated_claims() -> None:
    failing = row(9, len(OTHERS))
    failing["verdicts"][STATED[0]] = False
    np.testing.assert_array_equal(front([failing, row(8, len(OTHERS))]).stated, [False, True])
