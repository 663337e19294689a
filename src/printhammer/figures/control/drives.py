"""Figures of feedback, compared with other drives, and of bursts of least work.

`plot_burst` draws motion, current and energies of a burst of least work, `plot_rates` the work against the
rate.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from printhammer.control.feedback.comparison import Feedback
from printhammer.control.least_work.burst import LeastWork
from printhammer.control.least_work.rates import LeastWorkRates
from printhammer.figures.elements import style
from printhammer.figures.elements.marks import beside, dashed, dots, heading, legend_above
from printhammer.figures.elements.scales import Scale, label, scale
from printhammer.figures.elements.style import new_figure, new_panel, sign, styled, with_strip
from printhammer.figures.elements.timeline import between_surfaces, current_between
from printhammer.run.energy import coil_power
from printhammer.support.arrays import FloatArray
from printhammer.units import from_si

_COLOURS: Final = (style.ORANGE, style.YELLOW, style.GREEN)
_MARKS: Final = ("s", "^", "D")
_BINS: Final = 41  # Bins of a histogram, odd so that one is centred at zero; arbitrary
_REACH: Final = 4.0  # Half-width of the axis in units of the limit; arbitrary


@styled
def plot(feedback: Feedback) -> Figure:
    """Draw the deviations of dots printed with feedback and with other drives.

    Above: histograms of the deviations over all patterns, without lost dots; the end bins contain the
    deviations beyond the axis. Below: deviation of the second of two dots against the time between their
    slots. Dots between the dashed lines are within limits.
    """
    figure = new_figure(5.6)
    grid = figure.add_gridspec(2, 2)
    above = [figure.add_subplot(grid[0, column]) for column in range(2)]
    below = [figure.add_subplot(grid[1, column]) for column in range(2)]
    units = (("Force deviation  [%]", 100.0), ("Arrival deviation  [µs]", from_si(1.0, "s", "us")))
    limits = (feedback.limits.force, feedback.limits.arrival)
    for column, ((name, factor), limit) in enumerate(zip(units, limits, strict=True)):
        values = (feedback.force, feedback.arrival)[column] * factor
        pairs = (feedback.gap_force, feedback.gap_arrival)[column] * factor
        _histogram(above[column], feedback, values, limit * factor)
        above[column].set_xlabel(name)
        _by_gap(below[column], feedback, pairs, limit * factor)
        below[column].set_ylabel(name)
        below[column].set_xlabel("Time between two slots  [ms]")
    above[0].set_ylabel("Fraction of the dots")
    heading(above[0], f"All dots of the patterns of eight slots at {feedback.rate:.6g} Hz")
    heading(above[1], "larger deviations: in the end bins", loc="right")
    heading(below[0], "The second of two dots")
    # Leave room for the legend above the bars.
    room = 1.1 + 0.14 * len(feedback.strategies)
    highest = above[1].get_ylim()[1]
    above[1].set_ylim(0.0, room * highest)
    for ax, top, limit, (_name, factor) in zip(above, (1.0, 1.0 / room), limits, units, strict=True):
        dashed(ax.axvline, -limit * factor, limit * factor, ymax=top)
        ax.set_yticks([tick for tick in ax.get_yticks() if 0.0 <= tick <= min(1.0, highest)])
    above[1].legend(fontsize=style.SMALL, frameon=False, loc="upper right")
    remarks = [
        f"{name}: {int(lost)} dots are lost"
        for name, lost in zip(feedback.strategies, feedback.lost, strict=True)
        if lost
    ]
    sign(figure, feedback.driven, "; ".join(remarks) + "." if remarks else "")
    return figure


def _style_of(feedback: Feedback, number: int) -> tuple[str, str]:
    """Return colour and marker of a strategy by index; the last strategy is feedback."""
    if number == len(feedback.strategies) - 1:
        return style.BLUE, "o"
    return _COLOURS[number % len(_COLOURS)], _MARKS[number % len(_MARKS)]


def _histogram(ax: Axes, feedback: Feedback, values: FloatArray, limit: float) -> None:
    """Draw one histogram of deviations per strategy.

    `values` has one row per strategy; the axis covers a multiple of `limit`, and the end bins contain the
    deviations beyond the axis.
    """
    reach = _REACH * limit
    edges = np.linspace(-reach, reach, _BINS + 1)
    for number, name in enumerate(feedback.strategies):
        known = values[number][np.isfinite(values[number])]
        if not known.size:
            continue
        counts, _ = np.histogram(np.clip(known, -reach, reach), edges)
        text = f"{name}: {100.0 * feedback.passed[number].mean():.0f} % of the patterns"
        colour, _marker = _style_of(feedback, number)
        last = number == len(feedback.strategies) - 1
        how: dict[str, Any] = {
            "fill": last,
            "alpha": 0.75 if last else 1.0,
            "lw": style.THIN,
            "label": text,
            "gid": name,
        }
        ax.stairs(counts / known.size, edges, color=colour, **how)
    ax.set_xlim(-reach, reach)


def _by_gap(ax: Axes, feedback: Feedback, values: FloatArray, limit: float) -> None:
    """Draw the deviation of the second of two dots against the time between their slots.

    `values` has one row per strategy; dashed lines mark plus and minus `limit`.
    """
    gaps = from_si(1.0, "s", "ms") * feedback.gaps
    reach = _REACH * limit
    for number, name in enumerate(feedback.strategies):
        colour, marker = _style_of(feedback, number)
        how: dict[str, Any] = {"marker": marker, "ms": 2.6, "lw": style.THIN, "label": name, "gid": name}
        ax.plot(gaps, np.clip(values[number], -reach, reach), color=colour, **how)
    dashed(ax.axhline, -limit, limit)
    ax.axhline(0.0, color=style.FAINT, lw=style.HAIR, zorder=0)
    ax.set_ylim(-1.05 * reach, 1.05 * reach)
    ax.set_xlim(float(gaps[0]), float(gaps[-1]) if len(gaps) > 1 else float(gaps[0]) + 1.0)


@styled
def plot_run(feedback: Feedback) -> Figure:
    """Draw one run with feedback: displacement and current against time.

    Above: displacement, the samples used by the controller, and the target touch times (short lines at the
    pack front). Below: the current and its limits.
    """
    figure = new_figure(4.6)
    panel, strip = with_strip(figure, 2.6)
    run, hammer = feedback.run, feedback.driven
    assert hammer.front is not None
    ms, um = scale("time").factor, scale("displacement").factor
    room = between_surfaces(panel, hammer, run.motion, 2.0)
    samples = {"marker": ".", "mew": None, "label": "sensor samples", "gid": "samples"}
    dots(panel, ms * run.times, um * run.shown, 2.0, style.ORANGE, **samples)
    front = um * hammer.front
    due: dict[str, Any] = {"color": style.BLUE, "lw": style.LINE, "label": "target touch", "gid": "due"}
    panel.vlines(ms * run.due, front - 0.6 * room, front + 0.6 * room, **due)
    heading(panel, f"Slots {run.pattern} at {feedback.rate:.6g} Hz with feedback")
    panel.legend(fontsize=style.SMALL, frameon=False, loc="upper right", ncols=2)
    current_between(strip, run.motion, feedback.driver.current)
    strip.set_ylim(-1.2 * feedback.driver.current, 1.2 * feedback.driver.current)
    strip.set_xlabel("Time  [ms]")
    first, last = float(run.due[0]), float(run.due[-1])
    span = feedback.single.flight_time
    panel.set_xlim(ms * (first - 1.3 * span), ms * min(last + 3.0 * span, float(np.max(run.motion.t))))
    sign(figure, hammer)
    return figure


_AFTER: Final = 0.08  # Time shown after the armature rests, as a fraction of the time to rest; arbitrary


@styled
def plot_burst(burst: LeastWork) -> Figure:
    """Draw a burst of least work: motion, current, power and energies.

    Above: displacement, current, and coil power, filled in different colours for supplied and recovered
    power. Below: work of the coil and losses, relative to the energy absorbed by the pack.
    """
    figure = new_figure(6.6)
    grid = figure.add_gridspec(4, 1, height_ratios=(2.6, 1.2, 1.4, 1.3))
    motion = figure.add_subplot(grid[0])
    current = figure.add_subplot(grid[1], sharex=motion)
    power = figure.add_subplot(grid[2], sharex=motion)
    run, hammer = burst.motion, burst.hammer
    assert hammer.front is not None
    between_surfaces(motion, hammer, run, 2.2)
    ms, um = scale("time").factor, scale("displacement").factor
    for contact, force in zip(burst.contacts, burst.forces.tolist(), strict=True):
        place = (ms * contact.t_peak, um * (hammer.front + contact.depth))
        beside(motion, f"{force:.3f}", place, (0.0, 3.0), "center baseline")
    heading(motion, f"{len(burst.contacts)} dots at {burst.rate:.6g} Hz, force over that of a single pulse")
    current_between(current, run, burst.largest)
    span = 1.15 * burst.largest
    current.set_ylim(min(1.15 * float(run.current.min()), -0.2 * span), span)
    watts = coil_power(hammer, run.x, run.v, run.force["magnet"])
    power.fill_between(
        ms * run.t,
        np.maximum(watts, 0.0),
        0.0,
        color=style.ORANGE,
        lw=0.0,
        label="supplied by the coil",
        gid="given",
    )
    power.fill_between(
        ms * run.t, np.minimum(watts, 0.0), 0.0, color=style.GREEN, lw=0.0, gid="taken back"
    ).set_label("recovered by the coil")
    legend_above(power, power.get_legend_handles_labels()[0])
    power.set_ylabel("Coil power  [W]")
    power.set_xlabel("Time  [ms]")
    motion.set_xlim(0.0, ms * min((1.0 + _AFTER) * burst.rest_time, run.end))
    for ax in (motion, current):
        ax.tick_params(axis="x", labelbottom=False)
    _ledger(figure.add_subplot(grid[3]), burst)
    few = burst.adequate < burst.count
    sign(figure, hammer, f"{burst.adequate} of {burst.count} dots are adequate." if few else "")
    return figure


def _ledger(ax: Axes, burst: LeastWork) -> None:
    absorbed = burst.ledger.pack_loss
    if not absorbed > 0.0:
        ax.text(0.5, 0.5, "The pack absorbed no energy.", ha="center", va="center", transform=ax.transAxes)
        ax.set_axis_off()
        return
    bars = [
        ("absorbed by the pack", 1.0, style.YELLOW),
        ("net work W", burst.net_ratio, style.BLUE),
        ("positive work W+", burst.positive_ratio, style.ORANGE),
        ("W, single pulses", burst.single_ratio, style.MUTED),
        ("lost at the backstop", burst.ledger.backstop_loss / absorbed, style.SURFACES["backstop"]),
    ]
    rows = np.arange(len(bars))[::-1]
    longest = max(value for _name, value, _colour in bars)
    ax.barh(rows, [value for _, value, _ in bars], color=[colour for *_, colour in bars], height=0.66)
    for row, (_name, value, _colour) in zip(rows.tolist(), bars, strict=True):
        ax.text(
            value + 0.01 * longest, row, f"{round(value, 3) + 0.0:.3f}", va="center", fontsize=style.SMALL
        )
    ends = [rows[2] - 0.45, rows[2] + 0.45]
    ax.plot([burst.bound_ratio] * 2, ends, color=style.INK, lw=style.LINE, gid="least positive work")
    ax.set_yticks(rows, [name for name, *_ in bars], fontsize=style.SMALL)
    ax.set_xlim(0.0, 1.1 * longest)
    ax.set_xlabel("Energy relative to that absorbed by the pack (line: lower bound of W+)")


@styled
def plot_rates(bursts: LeastWorkRates) -> Figure:
    """Draw net work, positive work, and the lower bound of the positive work against the rate.

    Crosses at the bottom mark rates at which no current was found.
    """
    figure, ax = new_panel(3.6)
    across = Scale("Rate", "Hz", "Hz")
    rates = across.shown(bursts.rates)
    thick: dict[str, Any] = {"lw": style.LINE, "ms": 4.0}
    ax.plot(rates, bursts.positive_ratio, "o-", color=style.ORANGE, label="positive work W+", **thick)
    least = "lower bound of W+"
    ax.plot(rates, bursts.bound_ratio, color=style.INK, lw=style.THIN, ls=(0, (4, 3)), label=least)
    ax.plot(rates, bursts.net_ratio, "s-", color=style.BLUE, label="net work W", **thick)
    missing = bursts.status != "ok"
    if missing.any():
        ax.plot(rates[missing], [0.04] * int(missing.sum()), "x", color=style.MUTED, label="no current found")
    ax.set_ylim(bottom=0.0)
    ax.set_ylabel("Work relative to the energy absorbed by the pack")
    label(ax, "x", across)
    ax.legend(fontsize=style.SMALL, loc="lower right", frameon=False)
    heading(ax, f"Bursts of {bursts.count} dots")
    ax.margins(x=0.03)
    sign(figure, bursts.hammer)
    return figure
