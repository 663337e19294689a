"""Tests of candidates: hammers of the search space with the printed stroke, judged by the claims."""

import numpy as np
import pytest
from studies.reconstruction.search.candidates import candidates
from studies.reconstruction.search.space import PRINT_FORCE, geometry, hammer_of, point_of, values_at
from studies.reconstruction.tests.samples import near_points, random_points, some_candidates

from printhammer.claims import Context, claims, judge
from printhammer.claims.judging import within
from printhammer.hammer.equilibrium import rest_state


def test_candidates_print_the_stroke_of_the_paper() -> None:
    claim = claims()["single_pulse_stroke"]
    found = some_candidates()
    assert len(found) > 6
    for candidate in found:
        # Judged at the default tolerance, ten times tighter than in the search.
        context = Context(candidate.hammer)
        value = judge(context, claim).value
        assert value is not None
        assert within(value["max_displacement_m"], claim.band["max_displacement_m"])
        assert value["max_displacement_m"] == pytest.approx(geometry()["top"], abs=0.2e-6)
        # By equation (5), 0.2 um of the indentation of 81 um is 0.7 % of the force.
        assert context.print_force == pytest.approx(PRINT_FORCE, rel=0.007)
        assert candidate.rest == pytest.approx(rest_state(candidate.hammer), abs=1e-12)


def test_a_candidate_is_where_its_point_is() -> None:
    for candidate in some_candidates():
        assert candidate.hammer.fingerprint == hammer_of(candidate.constants).fingerprint
        back = point_of(values_at(candidate.point))
        np.testing.assert_allclose(back, candidate.point, atol=1e-12)
        assert candidate.state == (candidate.rest, 0.0)
        assert candidate.waveform.shape == "rectangle"


def test_a_candidate_does_not_depend_on_those_beside_it() -> None:
    points = random_points(5, 3) + near_points(3, 4)
    together = candidates(points)
    for point, found in zip(points, together, strict=True):
        (alone,) = candidates([point])
        assert (alone is None) == (found is None)
        if alone is not None and found is not None:
            assert alone.constants == found.constants
            assert alone.rest == found.rest


def test_none_where_the_current_cannot_release_the_armature() -> None:
    values = values_at(near_points(1, 0, apart=0.0)[0]) | {"release": 0.03, "margin": 0.6}
    values["bias"] = 0.2
    point = point_of(values)
    # Equations (3) and (4): the magnet holds against the spring even at the largest current.
    share = (1.0 - values["release"]) ** 2
    assert share - values["bias"] > (1.0 - values["margin"]) * (1.0 - values["bias"])
    assert candidates([point]) == [None]


def test_none_where_there_is_no_hammer_file_for_a_point() -> None:
    point = near_points(1, 0, apart=0.0)[0]
    # The point has no force F0.
    point[1] = 0.0
    assert candidates([point]) == [None]


def test_no_points_are_no_candidates() -> None:
    assert candidates([]) == []


@pytest.mark.slow
def test_many_random_points_print_the_stroke_of_the_paper() -> None:
    points = random_points(96, 21)
    found = candidates(points)
    claim = claims()["single_pulse_stroke"]
    for candidate in found:
        if candidate is not None:
            value = judge(Context(candidate.hammer), claim).value
            assert value is not None
            assert within(value["max_displacement_m"], claim.band["max_displacement_m"])
    assert sum(candidate is not None for candidate in found) > len(points) / 4
