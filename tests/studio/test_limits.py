"""Runs of a page that exceed the step limit: curves and maps end with a message, sections are rejected."""

from collections.abc import Iterator

import numpy as np
import pytest
from tests.studio.node import Engine
from tests.studio.reading import STATE
from tests.studio.test_live import NAME

import printhammer as ph
from printhammer.studio import Shelf, bounds

pytestmark = pytest.mark.slow  # linking needs the extra `page`

LIMITS = {"MOST_STEPS": 200, "MOST_MAP_STEPS": 400, "MOST_SECTION_STEPS": 2000}
SET = {**STATE, "hammer": NAME, "pulses": 9}


@pytest.fixture(scope="module")
def engine(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Engine]:
    with pytest.MonkeyPatch.context() as patch:
        for name, limit in LIMITS.items():
            patch.setattr(bounds, name, limit)
        made = Engine(Shelf(ph.load(NAME), only=True), tmp_path_factory.mktemp("engine"))
    with made:
        yield made


def test_curves_end_at_the_limit_of_steps(engine: Engine) -> None:
    curve, shown = engine.work("curves", SET)
    assert (curve["status"], curve["steps"]) == ("step limit", LIMITS["MOST_STEPS"] + 1)
    assert f"more than {LIMITS['MOST_STEPS']} steps" in curve["message"]
    end = curve["data"]["t"][-1]
    assert 0.0 < end < 8 / SET["rate"]
    assert len(shown["dots"]) == sum(time <= end for time in curve["fired"])


def test_rates_of_a_map_that_take_too_many_steps_are_not_shown(engine: Engine) -> None:
    part = {"rates": [500.0, 2000.0], "columns": 40, "wanted": False}
    (many,) = engine.work("piece", SET, part=part)
    assert many["ok"] == [False, False]
    (one,) = engine.work("piece", {**SET, "pulses": 1}, part=part)
    assert one["ok"] == [True, True]
    assert np.isfinite(one["x"]).all()
    slow, fast = np.reshape(np.array(many["x"], dtype=np.float64), (2, 40))
    assert np.isfinite(slow[0])
    assert np.isnan(slow[-1])
    assert np.isnan(fast[-1])


def test_a_section_that_takes_too_many_steps_is_refused(engine: Engine) -> None:
    # At a low rate, the armature settles after every firing.
    (refused,) = engine.work("section", {**SET, "rate": 50.0}, counts=[25, 50], judged=None)
    assert "the first 25 strobe points" in refused["refusal"]
    assert f"more than {LIMITS['MOST_SECTION_STEPS']} steps" in refused["refusal"]
