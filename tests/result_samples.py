"""One small result of every class, by the name of the class."""

from collections.abc import Callable

from printhammer.hammer.hammer import Hammer
from printhammer.results import Result


def strobe(hammer: Hammer) -> Result:
    from printhammer.chaos.strobe.points import strobe

    return strobe(hammer, period=1.3e-3, points=5, verdict=False)


def quality(hammer: Hammer) -> Result:
    from printhammer.printing.rates.quality import quality

    return quality(hammer, 900.0, "1101")


def safe_rate(hammer: Hammer) -> Result:
    from printhammer.printing.rates.safe_rate import safe_rate

    return safe_rate(hammer, first=600.0, last=700.0, step=100.0, cycle=False)


def tolerance_yield(hammer: Hammer) -> Result:
    from printhammer.printing.rates.tolerance import tolerance_yield

    return tolerance_yield(hammer, number=2, first=600.0, last=700.0, step=100.0)


def damping_study(hammer: Hammer) -> Result:
    from printhammer.printing.rates.damping import damping_study
    from printhammer.printing.rates.materials import Material

    tried = [Material("as it is", "as it is", {}), Material("hard", "none", {"backstop.stiffness": -1.0})]
    return damping_study(hammer, tried, first=600.0, last=700.0, step=100.0)


def page(hammer: Hammer) -> Result:
    from printhammer.printing.page.page import print_page

    return print_page(hammer, "Hi", 1500.0)


def compensation_table(hammer: Hammer) -> Result:
    from tests.control.table.by_hand import by_hand

    return by_hand(hammer)


def table_report(hammer: Hammer) -> Result:
    from tests.control.table.by_hand import by_hand

    from printhammer.control.table.report import judge_table
    from printhammer.printing.rates.perturbation import Perturbation

    return judge_table(hammer, by_hand(hammer), rates=[900.0], perturbations=[Perturbation()])


SAMPLES: dict[str, Callable[[Hammer], Result]] = {
    "CompensationTable": compensation_table,
    "DampingStudy": damping_study,
    "Page": page,
    "Quality": quality,
    "SafeRate": safe_rate,
    "Strobe": strobe,
    "TableReport": table_report,
    "ToleranceYield": tolerance_yield,
}
