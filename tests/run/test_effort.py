"""Effort: declared once, shown in signatures and docstrings, checked before the computation starts."""

import inspect
from collections.abc import Callable
from typing import Any

import pytest

import printhammer as ph
from printhammer.errors import InputError
from printhammer.run.effort import Effort

NAMES = ("tolerance", "threads", "progress")


def verbs() -> list[Callable[..., Any]]:
    """Return the public functions that take keywords of an effort."""
    public = [getattr(ph, name) for name in ph.__all__]
    return [verb for verb in public if inspect.isfunction(verb) and "effort" in innermost(verb)]


def innermost(verb: Callable[..., Any]) -> list[str]:
    """Return the parameters of the function inside its decorators."""
    return list(inspect.signature(inspect.unwrap(verb), follow_wrapped=False).parameters)


@pytest.mark.parametrize("verb", verbs(), ids=lambda verb: verb.__name__)
def test_signature_and_docstring_show_the_keywords(verb: Callable[..., Any]) -> None:
    parameters = inspect.signature(verb).parameters
    doc = verb.__doc__ or ""
    assert "effort" not in parameters
    assert [name for name in NAMES if name in parameters]
    for name in NAMES:
        assert (name in parameters) == (f"\n{name} : " in doc), name
        if name in parameters:
            assert parameters[name].kind is inspect.Parameter.KEYWORD_ONLY
    assert ("firing" in parameters) == ("\n**firing\n" in doc)
    order = [
        doc.find(f"\n{head}") for head in (*(f"{name} : " for name in NAMES), "**firing\n", "\nReturns\n-")
    ]
    shown = [place for place in order if place >= 0]
    assert shown == sorted(shown)


@pytest.mark.parametrize("verb", verbs(), ids=lambda verb: verb.__name__)
def test_unknown_keywords_are_refused(verb: Callable[..., Any]) -> None:
    with pytest.raises(
        TypeError, match=rf"{verb.__name__}\(\) got an unexpected keyword argument 'tolerence'"
    ):
        verb(tolerence=1e-9)


@pytest.mark.parametrize(("name", "value"), [("tolerance", 1.0), ("tolerance", 0.0), ("threads", 0)])
def test_values_are_checked_when_the_effort_is_made(name: str, value: Any) -> None:
    with pytest.raises(InputError, match=name):
        Effort(**{name: value})


def test_parts_of_the_work_report_their_share() -> None:
    told: list[tuple[int, int]] = []
    effort = Effort(1e-9, 2, lambda done, total: told.append((done, total)))
    effort.within(10, 40).report(3, 5)
    effort.quiet.report(1, 1)
    effort.alone.report(1, 1)
    assert told == [(13, 40)]
    assert effort.alone.threads == 1
    assert effort.at(1e-7) == Effort(1e-7, 2)


TOLERANCES = {
    "basins": 1e-9,
    "bifurcation": 1e-9,
    "continuation": 1e-13,
    "dead_time": 2e-11,
    "feedback": 5e-7,
    "frequency_map": 2e-11,
    "judge_table": 5e-7,
    "least_work": 1e-9,
    "orbits": 1e-13,
    "print_page": 5e-7,
    "quench_map": 5e-7,
    "safe_rate": 2e-11,
    "sections": 2e-11,
    "tolerance_yield": 5e-7,
    "tune": 5e-7,
}


@pytest.mark.parametrize("name", [name for name in TOLERANCES if name in ph.__all__])
def test_default_tolerances(name: str) -> None:
    assert inspect.signature(getattr(ph, name)).parameters["tolerance"].default == TOLERANCES[name]
