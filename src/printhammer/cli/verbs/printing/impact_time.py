"""The verb `impact-time`: how well samples of the coil tell when a dot is struck."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, verb
from printhammer.cli.screen import render

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer


@verb(
    "impact-time",
    "printhammer impact-time impact-wire --noise '2 mA, 20 mA, 4' --sampling-rate '200 kHz, 1 MHz, 2'"
    " --bits 12 --out impact.svg",
    {
        "signal": opt.choice("current|voltage", "What is sampled.", default="current"),
        "full_scale": opt.text("VALUE", "Largest value that the converter shows."),
        "dots": opt.whole("Dots in each way to sample.", default=50),
        "seed": opt.whole("Of hammers and noise.", default=0),
    },
    out=opt.results("Errors"),
)
def impact_time(
    job: Job,
    hammer: Hammer = opt.FIRED,
    noise: tuple[str, str, int] | None = opt.span(
        "Of a sample (0.1, 0.3, 1 % of the largest current; of 10 V)."
    ),
    sampling_rate: tuple[str, str, int] | None = opt.span("Samples per second (1 MHz)."),
    bits: list[str] | None = opt.text("N", "Of the converter (12); may be given repeatedly.", many=True),
    hammers: int = opt.whole("Hammers of a production that are drawn.", default=20),
    units: Units = opt.UNITS,
    **passed: Any,
) -> Answer:
    """Estimate times of impact from samples of current or voltage of the coil, and tell their error."""
    from printhammer.control.impact_estimator import UNITS
    from printhammer.control.impact_time import impact_time as studied

    grids: dict[str, Any] = {
        "noise": opt.between(noise, UNITS[passed.get("signal", "current")], "--noise"),
        "sampling_rate": opt.between(sampling_rate, "Hz", "--sampling-rate"),
        "bits": [opt.read_whole(each, "--bits") for each in bits or ()],
    }
    with job.counting("sampled") as tell:
        study = studied(
            hammer,
            progress=tell,
            units=hammers,
            **{name: grid for name, grid in grids.items() if grid},
            **passed,
        )
    return Answer(render(study.summary(), units), files={"out": Content.of(study)})
