"""The verb `basins`: which initial states lead where; with `--quench`, which second pulses lose their dot."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from printhammer.cli import options as opt
from printhammer.cli.options import Units, range_with_unit, with_unit
from printhammer.cli.runner import Answer, Content, Job, ended_early, firing_of, verb
from printhammer.cli.screen import facts

if TYPE_CHECKING:
    from printhammer.chaos.basins.basins import Basins
    from printhammer.chaos.basins.quench import QuenchMap
    from printhammer.chaos.orbits.manifolds import Manifolds
    from printhammer.hammer.hammer import Hammer

_BASINS: Final = "Basins"
_QUENCH: Final = "Quench map"
_ROWS: Final = 12
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
            status, content, rows = mapped.status, Content.of(mapped), quenched(mapped, units)
        else:
            planes = computed(hammer, progress=tell, **firing, **passed)
            status, rows = planes.status, led(planes, box, units)
            content = Content.of(planes)
    if saddles is not None:
        curves, said = curves_of(job, planes, saddles)
        rows += said
        content = Content.of(planes, manifolds=curves)
    return Answer(
        [facts(rows)],
        note=f"{status.size} cells, computed in {job.seconds:.2g} s",
        files={"out": content},
        complaints=ended_early(status[status != NO_STATE_STATUS], status.size),
    )


def curves_of(job: Job, planes: Basins, longest: int) -> tuple[list[Manifolds], list[tuple[str, str | None]]]:
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
    rows: list[tuple[str, str | None]] = [("saddles", f"manifolds of {len(curves)} drawn")]
    if len(known) > len(shown):
        rows.append(("", f"{len(known) - len(shown)} more are in the pack at the firing"))
    return curves, rows


def led(result: Basins, box: int | None, units: Units) -> list[tuple[str, str | None]]:
    """Return the attractors with their shares, the cells that lead to none, and the basin entropy."""
    from printhammer.chaos.basins.basins import BOX, UNDECIDED

    rows: list[tuple[str, str | None]] = []
    share, error = result.shares
    for row, attractor in enumerate(result.attractors[:_ROWS]):
        x, v = attractor.states[0].tolist()
        first = f", first at {with_unit(x, 'length', units)}, {with_unit(v, 'speed', units)}"
        name = attractor.name.replace("-", " ")
        part = f"{100.0 * share[row]:.2f} ± {100.0 * error[row]:.2f} % of the states"
        rows.append(
            (
                f"attractor {row + 1}",
                f"[bold]{name}[/bold], {part}{'' if attractor.period is None else first}",
            )
        )
    if len(result.attractors) > _ROWS:
        rows.append(("", f"and {len(result.attractors) - _ROWS} more"))
    after = (
        f" after {result.firings.max()} firings, more --rounds may tell" if result.counts[UNDECIDED] else ""
    )
    rows += [
        (name, f"{result.counts[label]} of {result.labels.size} cells{after if label == 0 else ''}")
        for label, name in ((0, "undecided"), (-1, "ended early"), (-2, "no state"))
        if result.counts[label] or label == 0
    ]
    entropy = result.entropy(box=min(BOX, *result.labels.shape) if box is None else box)
    boundary = (
        "no box on a boundary"
        if math.isnan(entropy.boundary_entropy)
        else f"{entropy.boundary_entropy:.4f} in the {entropy.boundary_boxes} boxes on a boundary"
        f"{', more than ln 2: a fractal one' if entropy.fractal else ''}"
    )
    boxes = f"{entropy.boxes} boxes of {entropy.box} x {entropy.box} cells"
    return [*rows, ("basin entropy", f"{entropy.entropy:.4f} in {boxes}, {boundary}")]


def quenched(result: QuenchMap, units: Units) -> list[tuple[str, str | None]]:
    """Return how many second dots are lost, and how the others differ from the first."""
    force = with_unit(result.single_force, "force", units)
    flight = with_unit(result.single_flight_time, "time", units)
    rows: list[tuple[str, str | None]] = [
        (
            "second dots",
            f"{int(result.struck.sum())} printed, {int(result.lost.sum())} of {result.status.size} lost",
        ),
        ("first alone", f"{force}, flight time {flight}"),
    ]
    if result.struck.any() and math.isfinite(result.single_force):
        ratio, gain = result.force_ratio[result.struck], result.flight_gain[result.struck]
        rows.append(("force ratio", f"{ratio.min():.3f} to {ratio.max():.3f}"))
        rows.append(("flies shorter by", range_with_unit(gain, "time", units)))
    return rows
