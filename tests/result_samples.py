"""One small result of every class, by the name of the class."""

from collections.abc import Callable

from printhammer.hammer.hammer import Hammer
from printhammer.results import Result


def strobe(hammer: Hammer) -> Result:
    from printhammer.chaos.strobe import strobe

    return strobe(hammer, period=1.3e-3, points=5, verdict=False)


def compensation_table(hammer: Hammer) -> Result:
    from tests.control.table.by_hand import by_hand

    return by_hand(hammer)


def table_report(hammer: Hammer) -> Result:
    from tests.control.table.by_hand import by_hand

    from printhammer.control.table.report import judge_table
    from printhammer.printing.perturbation import Perturbation

    return judge_table(hammer, by_hand(hammer), rates=[900.0], perturbations=[Perturbation()])


SAMPLES: dict[str, Callable[[Hammer], Result]] = {
    "CompensationTable": compensation_table,
    "Strobe": strobe,
    "TableReport": table_report,
}
