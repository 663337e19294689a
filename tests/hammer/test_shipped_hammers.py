"""The shipped hammers: their files, and the textbook cases against their references."""

import pytest
from tests.truth.impact_orbits import BouncingBall, LinearImpacts
from tests.truth.test_continuation_impacts import ball_of, oscillator_of

import printhammer as ph
from printhammer.hammer.hammer import shipped

TEXTBOOK = {
    "bouncing-ball",
    "den-hartog-1931",
    "duffing-holmes",
    "housner-1963",
    "impact-pair",
    "linear-impact-oscillator",
    "resonant-grazing",
    "shaw-1985",
    "shaw-holmes-1983",
    "tufillaro-1992",
    "tung-shaw-1988",
}
PRINTED = {"dankowicz-schilder-2013"}
"""Its source prints every constant."""
DEVICES = {
    "braille-embosser",
    "dot-peen",
    "impact-wire",
    "pinball-coil",
    "pinball-flipper",
    "pot-magnet",
    "relay-5v",
}
"""Of data sheets; see tests of those."""


def test_the_textbook_cases_are_shipped() -> None:
    assert TEXTBOOK | PRINTED | DEVICES | {"hendriks-1983", "hendriks-1983-1"} == set(shipped())


@pytest.mark.parametrize("name", shipped())
def test_a_shipped_file_says_what_it_is(name: str) -> None:
    hammer = ph.load(name)
    assert hammer.name == name
    assert hammer.title
    assert len(hammer.title) < 80
    assert hammer.note
    assert all(len(constant.source) > 3 for constant in hammer.constants.values())


@pytest.mark.parametrize("name", sorted(TEXTBOOK))
def test_nothing_of_a_textbook_case_passes_for_measured(name: str) -> None:
    statuses = {constant.status for constant in ph.load(name).constants.values()}
    assert statuses <= {"assumed", "derived"}


def test_the_ball_is_that_of_the_closed_form() -> None:
    ball = ph.load("bouncing-ball")
    gravity = -ball.constants["spring.preload"].si / ball.mass
    assert gravity == pytest.approx(9.80665, rel=1e-15)
    case = BouncingBall(gravity, ball.constants["backstop.restitution"].si, 50.0)
    same = ball_of(case).replace("spring.preload", ball.constants["spring.preload"])
    assert ball.fingerprint == same.fingerprint


def test_the_oscillator_is_that_of_the_closed_form() -> None:
    oscillator = ph.load("linear-impact-oscillator")
    case = LinearImpacts(2.2, oscillator.origin, oscillator.constants["backstop.restitution"].si)
    assert oscillator.fingerprint == oscillator_of(case).fingerprint
