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


def feedback(hammer: Hammer) -> Result:
    from tests.control.feedback.by_hand import by_hand

    return by_hand(hammer)


def least_work(hammer: Hammer) -> Result:
    import pytest
    from tests.control.least_work.test_burst import let_go, thrown

    from printhammer.control.least_work import search
    from printhammer.control.least_work.burst import least_work

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search, "printing_current", thrown)
        patch.setattr(search, "landing_current", let_go)
        return least_work(hammer, rate="400 Hz", dots=2, force=0.3)


def least_work_rates(hammer: Hammer) -> Result:
    import numpy as np

    from printhammer.control.least_work.rates import LeastWorkRates

    ratio = np.array([1.2, np.nan])
    status = np.array(["ok", "no current found"])
    return LeastWorkRates(
        hammer, np.array([400.0, 4e3]), 2, ratio, ratio, ratio, ratio, np.array([2, 0]), status
    )


SAMPLES: dict[str, Callable[[Hammer], Result]] = {
    "CompensationTable": compensation_table,
    "Feedback": feedback,
    "LeastWork": least_work,
    "LeastWorkRates": least_work_rates,
    "Strobe": strobe,
    "TableReport": table_report,
}
