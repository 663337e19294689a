"""One small result of every class, by class name."""

from collections.abc import Callable
from functools import cache

import numpy as np
from tests.chaos.samples import CHAOS

import printhammer as ph
from printhammer.hammer.hammer import Hammer
from printhammer.results import Result
from printhammer.run.ensemble import EnsembleResult


def quality(hammer: Hammer) -> Result:
    from printhammer.printing.rates.quality import quality

    return quality(hammer, 900.0, "1101")


def safe_rate(hammer: Hammer) -> Result:
    from printhammer.printing.rates.safe_rate import safe_rate

    return safe_rate(hammer, first=600.0, last=700.0, step=100.0, long=False)


def tolerance_yield(hammer: Hammer) -> Result:
    from printhammer.printing.rates.tolerance import tolerance_yield

    return tolerance_yield(hammer, number=2, first=600.0, last=700.0, step=100.0)


def damping_study(hammer: Hammer) -> Result:
    from printhammer.printing.rates.damping import Material, damping_study

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
    from printhammer.printing.rates.variability import Perturbation

    return judge_table(hammer, by_hand(hammer), rates=[900.0], perturbations=[Perturbation()])


def learning(hammer: Hammer) -> Result:
    from tests.control.table.by_hand import by_hand

    from printhammer.control.learning.learn import Learning
    from printhammer.control.learning.sensor import ImpactSensor
    from printhammer.printing.dots.judging import Limits
    from printhammer.printing.rates.variability import Variability

    off = np.array([[0.0, 0.2, np.nan], [0.01, 0.02, 0.0]])
    return Learning(
        hammer=hammer,
        unit=hammer,
        table=by_hand(hammer),
        rate=900.0,
        driver="own",
        sensor=ImpactSensor(),
        variability=Variability(),
        limits=Limits(),
        dots=np.array([0, 25]),
        learned=np.array([False, True]),
        misfit=np.array([np.nan, 1.1]),
        multiplier=np.array([np.nan, 0.7]),
        expected=np.array([np.nan, 0.9]),
        certainty=np.array([np.nan, 0.6]),
        loop_certainty=np.array([np.nan, 0.8]),
        slot=np.array([192, 194, 195]),
        force_deviation=off,
        arrival_deviation=1e-4 * off,
        good=np.abs(off) <= 0.1,
        constants=("mass",),
        believed=np.array([2e-3]),
        uncertainty=np.array([1e-5]),
        contraction=np.array([0.98]),
        offset=2e-5,
        offset_uncertainty=1e-6,
        seed=1,
    )


def fit(hammer: Hammer) -> Result:
    from printhammer.identify.result import Fit, FittedConstant

    return Fit(
        kind="spring",
        source=("spring.csv",),
        constants={"spring.Bs": FittedConstant.of("spring.Bs", 1.0, 0.1, 3.0, "N")},
        keys=("spring.Bs",),
        covariance=np.array([[0.01]]),
        abscissa=np.array([1e-4, 2e-4, 3e-4]),
        data=np.array([1.0, 0.9, 0.7]),
        fitted=np.array([1.0, 0.9, 0.8]),
        residuals=np.array([0.0, 0.0, -0.1]),
        axes=(("displacement", "m"), ("force", "N")),
        degrees_of_freedom=2.0,
        residual_scale=0.1,
        weights=np.ones(3),
        outliers=np.array([False, False, True]),
        condition_number=1.5,
        series=np.zeros(3, np.int64),
        series_names=("spring",),
        lines=np.array([2, 3, 5]),
        given={"backstop.position": "50 um"},
    )


def not_none(result: Result | None) -> Result:
    assert result is not None
    return result


@cache
def ensemble(hammer: Hammer) -> EnsembleResult:
    drives = [ph.PulseTrain(hammer.waveform, rate=rate, pulses=2) for rate in (400.0, 500.0)]
    return ph.Ensemble(hammer, drives, 6e-3).run(
        dots=True, extra=True, strobes="firings", times=[1e-3, 2e-3, 3e-3]
    )


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


def dead_time(hammer: Hammer) -> Result:
    # With a blow that one of the rails does not reach.
    wire = ph.load("impact-wire")
    return ph.dead_time(wire, voltage=[20.0, 38.0], temperature=[20.0], blow=3.2)


def impact_time(hammer: Hammer) -> Result:
    # With samples so noisy that some impacts are not seen.
    wire = ph.load("impact-wire")
    return ph.impact_time(wire, noise=["5 mA", "70 mA"], dots=6, units=3)


def recorded_impacts(hammer: Hammer) -> Result:
    import numpy as np

    from printhammer.control.recorded_impacts import RecordedImpacts

    times, errors, sizes = np.array([2.6e-4, np.nan]), np.array([2e-6, 9e-6]), np.array([80.0, 2.0])
    names, flags = ("1.csv", "2.csv"), ("", "unseen")
    return RecordedImpacts(hammer, "current", 2.65e-4, names, times, errors, sizes, flags)


def thermal_duty(hammer: Hammer) -> Result:
    # Bursts of which one may last, and one melts the copper.
    bursts = ["100 Hz", "1 kHz", "1 MHz"]
    return ph.thermal_duty(
        "4 mJ", "12 K/W", 91.0, ambient=[25.0, 95.0], burst=bursts, thermal_capacity="2 J/K"
    )


SAMPLES: dict[str, Callable[[Hammer], Result]] = {
    **CHAOS,
    "CompensationTable": compensation_table,
    "DampingStudy": damping_study,
    "DeadTime": dead_time,
    "DotTable": lambda hammer: not_none(ensemble(hammer).dots),
    "EnsembleResult": ensemble,
    "ExtraDots": lambda hammer: not_none(ensemble(hammer).extra),
    "Feedback": feedback,
    "Fit": fit,
    "ImpactTime": impact_time,
    "Learning": learning,
    "LeastWork": least_work,
    "LeastWorkRates": least_work_rates,
    "Measurement": lambda hammer: ph.measure("pack", hammer, seed=1, points=5),
    "Motion": lambda hammer: ph.simulate(hammer, ph.PulseTrain(hammer.waveform), points=20),
    "Page": page,
    "Quality": quality,
    "RecordedImpacts": recorded_impacts,
    "SafeRate": safe_rate,
    "Strobes": lambda hammer: not_none(ensemble(hammer).strobes),
    "TableReport": table_report,
    "ThermalDuty": thermal_duty,
    "ThermalLimit": lambda hammer: ph.thermal_limit([25.0, 50.0], [1173.0, 728.0]),
    "ToleranceYield": tolerance_yield,
}
