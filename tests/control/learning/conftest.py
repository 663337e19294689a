"""Learning laws that several tests use."""

import numpy as np
import pytest

import printhammer as ph
from printhammer.control.learning.law import LearningLaw
from printhammer.control.learning.preparation import law_for
from printhammer.control.learning.sensor import ImpactSensor
from printhammer.printing.dots.strategy import LEAD_IN, cycle_with_lead_in, slots_of

RATE = 1275.0


@pytest.fixture(scope="session")
def law() -> LearningLaw:
    """Return a learning law for times and forces."""
    return law_for(ph.load("hendriks-1983-1"), RATE, sensor=ImpactSensor(force=0.03), members=150)[0]


@pytest.fixture(scope="session")
def by_time() -> LearningLaw:
    """Return a learning law for times alone."""
    return law_for(ph.load("hendriks-1983-1"), RATE, members=150)[0]


@pytest.fixture(scope="session")
def small() -> LearningLaw:
    """Return a learning law for times and forces, of a table with few entries and from few hammers."""
    sensor = ImpactSensor(force=0.03)
    return law_for(ph.load("hendriks-1983-1"), RATE, sensor=sensor, history=1, members=50)[0]


@pytest.fixture(scope="session")
def small_by_time() -> LearningLaw:
    """Return a learning law for times alone, of a table with few entries and from few hammers."""
    return law_for(ph.load("hendriks-1983-1"), RATE, history=1, members=50)[0]


@pytest.fixture
def brief(monkeypatch: pytest.MonkeyPatch) -> None:
    """Judge drives on the cycle, without long rows, and search from two hammers instead of six."""
    monkeypatch.setattr("printhammer.control.learning.learner._STARTS", 2)
    slots = slots_of(cycle_with_lead_in())
    for module in ("law", "learn"):
        monkeypatch.setattr(f"printhammer.control.learning.{module}.PRINTED", slots)
        monkeypatch.setattr(f"printhammer.control.learning.{module}.JUDGED", np.asarray(slots) >= LEAD_IN)
