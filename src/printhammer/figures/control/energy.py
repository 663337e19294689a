"""A burst of least work: motion, current, power of the coil, and where the energy went."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.figures.elements import style
from printhammer.figures.elements.marks import beside
from printhammer.figures.elements.style import new_figure, sign, styled
from printhammer.run.coil_work import coil_power
from printhammer.units import from_si

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from printhammer.control.least_work.burst import LeastWork

_AFTER: Final = 0.08


@styled
def plot(found: LeastWork) -> Figure:
    """Draw a burst of least work.

    Above: displacement, current, and the power of the coil, filled where it gives and where it takes back.
    Below: the work of the coil and the losses, in parts of what the pack absorbs.
    """
    figure = new_figure(6.6)
    grid = figure.add_gridspec(4, 1, height_ratios=(2.6, 1.2, 1.4, 1.3))
    motion = figure.add_subplot(grid[0])
    current = figure.add_subplot(grid[1], sharex=motion)
    power = figure.add_subplot(grid[2], sharex=motion)
    run = found.motion
    time = _ms(run.t)
    _motion(motion, found)
    current.plot(time, run.current, color=style.BLUE, lw=style.THIN, gid="current")
    current.axhline(0.0, color=style.FAINT, lw=style.HAIR, zorder=0)
    for bound in (-found.largest, found.largest):
        current.axhline(bound, color=style.MUTED, lw=style.HAIR, ls=(0, (4, 3)))
    span = 1.15 * found.largest
    current.set_ylim(min(1.15 * float(run.current.min()), -0.2 * span), span)
    current.set_ylabel("Current  [A]")
    watts = coil_power(found.hammer, run.x, run.v, run.force["magnet"])
    power.fill_between(time, np.maximum(watts, 0.0), 0.0, color=style.ORANGE, lw=0.0, gid="given")
    power.fill_between(time, np.minimum(watts, 0.0), 0.0, color=style.GREEN, lw=0.0, gid="taken back")
    power.set_ylabel("Coil power  [W]")
    power.set_xlabel("Time  [ms]")
    last = min((1.0 + _AFTER) * found.rest_time, run.end)
    motion.set_xlim(0.0, float(_ms(np.array([last]))[0]))
    for ax in (motion, current):
        ax.tick_params(axis="x", labelbottom=False)
    _ledger(figure.add_subplot(grid[3]), found)
    remark = ""
    if found.adequate < found.count:
        remark = f"{found.adequate} of {found.count} dots are adequate."
    sign(figure, found.hammer, remark)
    return figure


def _motion(ax: Axes, found: LeastWork) -> None:
    hammer, run = found.hammer, found.motion
    assert hammer.front is not None
    low, high = float(_um(run.x.min())), float(_um(run.x.max()))
    room = 0.08 * (high - low)
    top = high + 2.2 * room
    ax.axhspan(_um(hammer.front), top, color=style.SURFACES["pack"], alpha=0.14, lw=0.0)
    ax.axhspan(low - room, _um(hammer.origin), color=style.SURFACES["backstop"], alpha=0.25, lw=0.0)
    ax.plot(_ms(run.t), _um(run.x), color=style.INK, lw=style.LINE, gid="displacement")
    for contact, force in zip(found.contacts, found.forces.tolist(), strict=True):
        place = float(_ms(np.array([contact.t_peak]))[0])
        beside(ax, f"{force:.3f}", (place, float(_um(hammer.front + contact.depth))), (0.0, 3.0), ha="center")
    ax.set_ylim(low - room, top)
    ax.set_ylabel("Displacement  [µm]")
    ax.set_title(
        f"{len(found.contacts)} dots at {found.rate:.6g} Hz, force over that of a single pulse",
        loc="left",
        fontsize=style.SMALL,
    )


def _ledger(ax: Axes, found: LeastWork) -> None:
    absorbed = found.ledger.pack_loss
    if not absorbed > 0.0:
        ax.text(0.5, 0.5, "The pack absorbed nothing.", ha="center", va="center", transform=ax.transAxes)
        ax.set_axis_off()
        return
    bars = [
        ("absorbed by the pack", 1.0, style.YELLOW),
        ("net work W", found.net_ratio, style.BLUE),
        ("positive work W+", found.positive_ratio, style.ORANGE),
        ("W, single pulses", found.single_ratio, style.MUTED),
        ("lost at the backstop", found.ledger.backstop_loss / absorbed, style.SURFACES["backstop"]),
    ]
    rows = np.arange(len(bars))[::-1]
    longest = max(value for _name, value, _colour in bars)
    ax.barh(rows, [value for _, value, _ in bars], color=[colour for *_, colour in bars], height=0.66)
    for row, (_name, value, _colour) in zip(rows.tolist(), bars, strict=True):
        ax.text(value + 0.01 * longest, row, f"{value:.3f}", va="center", fontsize=style.SMALL)
    ax.plot(
        [found.bound_ratio] * 2,
        [rows[2] - 0.45, rows[2] + 0.45],
        color=style.INK,
        lw=style.LINE,
        gid="least positive work",
    )
    ax.set_yticks(rows, [name for name, *_ in bars], fontsize=style.SMALL)
    ax.set_xlim(0.0, 1.1 * longest)
    ax.set_xlabel("Energy over what the pack absorbs (line: least W+ of any current)")


def _ms(time: np.ndarray) -> np.ndarray:
    return np.asarray(from_si(1.0, "s", "ms") * time)


def _um(x: float | np.ndarray) -> float:
    return from_si(1.0, "m", "um") * x  # type: ignore[return-value]
