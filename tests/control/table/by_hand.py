"""Tables with invented entries. Helpers only."""

from typing import Any

import numpy as np
import pytest
from tests.hammers import CRUDE

import printhammer as ph
from printhammer.control.table import tuning
from printhammer.control.table.compensation import CompensationTable
from printhammer.control.table.drive import (
    REST,
    entries_of,
    histories,
    number_of,
    shared_numbers,
)
from printhammer.control.table.task import Task


def by_hand(
    hammer: ph.Hammer | None = None, gaps: int = 2, reach: int = 2, **changes: Any
) -> CompensationTable:
    """A table of two rates with a separate entry for each history: valid, but not tuned."""
    made_for = ph.load(CRUDE) if hammer is None else hammer
    width = made_for.waveform.width  # type: ignore[union-attr]
    shape = 2, entries_of(gaps, reach)
    values = {
        name: np.zeros(shape) for name in ("advance", "width", "brake_delay", "brake_width", "deviation")
    }
    values["multiplier"] = np.zeros(shape)
    for row in range(2):
        for place, history in enumerate(histories(gaps, reach)):
            column = number_of(history, reach)
            values["width"][row, column] = width * (1.0 - 0.001 * place - 0.01 * row)
            values["advance"][row, column] = 1e-7 * place if history[0] != REST else 0.0
            values["multiplier"][row, column] = np.nan if place == 2 else 0.1 * place - 0.3
            values["deviation"][row, column] = np.nan if place == 1 else 0.1 * row
    shared = shared_numbers(gaps, reach)
    settings = {
        "hammer": made_for.name,
        "fingerprint": made_for.fingerprint,
        "rates": np.array([800.0, 1000.0]),
        "gaps": gaps,
        "reach": reach,
        "largest_current": 2.0,
        **{name: array[:, shared] for name, array in values.items()},
    }
    return CompensationTable(**{**settings, **changes})


def task_of(hammer: ph.Hammer, rate: float) -> Task:
    """Return the tuning task of a one-gap table for a hammer: `tune` up to the choice of candidates."""
    asked: list[Task] = []

    def stop(task: Task, *_: Any, **__: Any) -> Any:
        asked.append(task)
        raise RuntimeError

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tuning, "chosen", stop)
        with pytest.raises(RuntimeError):
            ph.tune(hammer, rate=rate, history=1)
    return asked[0]
