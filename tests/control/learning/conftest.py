"""Learning laws that several tests use."""

import pytest

import printhammer as ph
from printhammer.control.learning.law import LearningLaw
from printhammer.control.learning.preparation import law_for
from printhammer.control.learning.sensor import ImpactSensor

RATE = 1275.0


@pytest.fixture(scope="session")
def law() -> LearningLaw:
    """Return a learning law for times and forces."""
    return law_for(ph.load("hendriks-1983-1"), RATE, sensor=ImpactSensor(force=0.03), members=150)[0]


@pytest.fixture(scope="session")
def by_time() -> LearningLaw:
    """Return a learning law for times alone."""
    return law_for(ph.load("hendriks-1983-1"), RATE, members=150)[0]
