"""The verb `basins`: which initial states lead where; with `--quench`, which second pulses lose their dot."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, ended_early, firing_of, verb
from printhammer.cli.screen import facts, render

if TYPE_CHECKING:
    from printhammer.chaos.basins.basins import Basins
    from printhammer.chaos.orbits.manifolds import Manifolds
    from printhammer.hammer.hammer import Hammer

_BASINS: Final = "Basins"
_QUENCH: Final = "Quench map"
_CROSSINGS: Final = 6
"""Length of a manifold over the longer side of the plane."""
_PIECES: Final = 200
"""Points of a manifold over that side."""
_count = partial(opt.whole, panel=_BASINS)


@verb(
    "basins",
    "printhammer basins hendriks-1983 --period '1.05 ms' --x '30 um, 260 um, 24'"
    " --v '-1 m/s, 1 m/s, 20' --out basins.png",
    {
        **opt.FIRED_TRAIN,
        "x": opt.span("Displacements, such as '30 um, 260 um, 128' (the strobe window).", panel=_BASINS),
        "v": opt.span("Velocities, such as '-1 m/s, 1 m/s, 128' (the strobe window).", panel=_BASINS),
        "firings": _count("Firings of a round (200)."),
        "rounds": _count("Rounds that a cell gets at most (20)."),
        "gaps": opt.span("Times between the two firings ('0.5 ms, 0.9 ms, 128').", panel=_QUENCH),
        "widths": opt.span("Widths of the second pulse (half to 1.5 of the first, 128).", panel=_QUENCH),
        "tail": opt.text("TIME", "Time within which a second dot is waited for (1 ms).", panel=_QUENCH),
        "tolerance": opt.TOLERANCE,
        "threads": opt.THREADS,
    },
    out=opt.results("Cells"),
)
def basins(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    box: int | None = _count("Cells along the side of a box, for the entropy (4)."),
    saddles: int | None = _count("Draw the manifolds of saddles of up to so many firings."),
    quench: bool = opt.switch("Map two pulses from rest instead.", panel=_QUENCH),
    units: Units = opt.UNITS,
    **passed: Any,
) -> Answer:
    """Tell which states lead to which attractor, or with --quench which second pulses lose their dot.

    Ends with status 1 where a run stopped before its end.
    """
    from printhammer.chaos.basins.basins import NO_STATE_STATUS
    from printhammer.chaos.basins.basins import basins as computed
    from printhammer.chaos.basins.quench import quench_map
    from printhammer.drive.input import read_count

    of_quench = {name: passed.get(name) for name in ("gaps", "widths", "tail")}
    if quench:
        of_basins = {name: passed.get(name) for name in ("period", "rate", "overlap", "drive", "x", "v")}
        more = {name: passed.get(name) for name in ("firings", "rounds")}
        opt.refuse({**of_basins, **more, "box": box, "saddles": saddles}, "none beside --quench")
    else:
        opt.refuse(of_quench, "--quench beside it")
        firing = firing_of(job, hammer, passed, "--period '1.05 ms', or --quench")
    if saddles is not None:
        read_count(saddles, "saddles")
    with job.counting("cells") as tell:
        if quench:
            mapped = quench_map(hammer, progress=tell, **passed)
            status, content, summary = mapped.status, Content.of(mapped), mapped.summary()
        else:
            planes = computed(hammer, progress=tell, **firing, **passed)
            status, summary = planes.status, planes.summary(box)
            content = Content.of(planes)
    shown = render(summary, units)
    if saddles is not None:
        curves, said = curves_of(job, planes, saddles)
        shown.append(facts(said))
        content = Content.of(planes, manifolds=curves)
    return Answer(
        shown,
        note=f"{status.size} cells, computed in {job.seconds:.2g} s",
        files={"out": content},
        complaints=ended_early(status[status != NO_STATE_STATUS], status.size),
    )


def curves_of(job: Job, planes: Basins, longest: int) -> tuple[list[Manifolds], list[tuple[str, str]]]:
    """Return the manifolds of all saddles of up to so many firings, and what is said of them."""
    import numpy as np

    from printhammer.chaos.orbits.manifolds import manifolds
    from printhammer.chaos.orbits.orbit import SADDLE
    from printhammer.chaos.orbits.search import orbits

    spans = np.array([np.ptp(planes.x), np.ptp(planes.v)]) / planes.regime.window.half_widths
    with job.counting("orbits", remaining=False) as tell:
        known = [
            orbit for orbit in orbits(planes.regime, longest=longest, progress=tell) if orbit.kind == SADDLE
        ]
    # The plane is that of the states at a firing.
    shown = [orbit for orbit in known if orbit.phase == planes.regime.phase]
    curves = []
    with job.counting("saddles") as tell:
        for number, saddle in enumerate(shown, 1):
            way = _CROSSINGS * float(spans.max())
            curves.append(manifolds(saddle, length=way, spacing=float(spans.max()) / _PIECES))
            tell(number, len(shown))
    rows = [("saddles", f"manifolds of {len(curves)} drawn")]
    if len(known) > len(shown):
        rows.append(("", f"{len(known) - len(shown)} more are in the pack at the firing"))
    return curves, rows
