"""Ways to drive a hammer that verbs offer beside the open loop: a compensation table, or feedback."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from printhammer.cli import options as opt
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.cli.runner import Job
    from printhammer.control.table.compensation import CompensationTable
    from printhammer.hammer.hammer import Hammer

TABLE: Final = opt.source("Compensation table to drive by (.csv, .json), from `printhammer tune`.")
SERIAL: Final = opt.text(
    "TEXT", "Serial number of the unit, for a table that was learned on one; 'any' to drive another."
)
FEEDBACK: Final = opt.switch("Drive with feedback, see `printhammer feedback`; takes a while.")


def chosen_strategy(
    job: Job, hammer: Hammer, table: Path | None, feedback: bool, serial: str | None = None
) -> tuple[dict[str, Any], CompensationTable | None]:
    """Return the argument `strategy` of what prints, empty for an open loop, and the table if there is one.

    Raises
    ------
    InputError
        Table and feedback are asked for at once, a serial without a table, or the table cannot be used for
        this hammer.
    """
    if serial is not None and table is None:
        raise InputError(
            f"--serial {serial}: expected a table that was learned, --table, beside it", key="--serial"
        )
    if feedback and table is not None:
        raise InputError(f"--table {table} and --feedback: expected one of them", key="--table")
    if table is not None:
        from printhammer.control.table.compensation import load_table

        loaded = load_table(table)
        return {"strategy": loaded.strategy(hammer, serial)}, loaded
    if not feedback:
        return {}, None
    from printhammer.control.feedback.closed_loop import FeedbackStrategy
    from printhammer.control.feedback.controller import Controller
    from printhammer.control.feedback.plant import driver_of

    with job.counting("tables of the controller") as tell:
        return {"strategy": FeedbackStrategy(Controller(hammer, driver_of(hammer), progress=tell))}, None
