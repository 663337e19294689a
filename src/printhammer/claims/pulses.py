"""Claims about a single pulse, two pulses, and buzz printing.

Single pulse: stroke, settle-out, forces, force-displacement loops of the contacts, and energies.

Two pulses, Fig. 6: the second pulse brakes the armature (quench), or accelerates the armature as it rises.

Buzz printing, Fig. 7: a train that prints while the armature stays off the backstop.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from printhammer.claims.context import TAIL, Context, NotMeasurableError
from printhammer.claims.judging import (
    WHOLE,
    Claim,
    Measured,
    claims,
    falling,
    largest,
    measures,
    rank_correlation,
)
from printhammer.drive.trains import PulseTrain
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.buzz import (
    BuzzSearch,
    BuzzTrain,
    delayed_train,
    find_buzz_train,
    longest_run,
)
from printhammer.printing.dots.settling import rebounds, touches
from printhammer.support.arrays import FloatArray


@measures("single_pulse_stroke", "pack", "waveform")
def single_pulse_stroke(context: Context, _claim: Claim) -> Measured:
    """Measure the peak displacement and the number of pack contacts after one pulse."""
    contacts = sum(c.surface == "pack" and not c.initial for c in context.single.contacts)
    value = {"max_displacement_m": context.peak, "contacts_with_pack": contacts}
    times = {1: "once"}.get(contacts, f"{contacts} times")
    return Measured(
        value, f"One pulse lifts the armature to {context.peak * 1e6:.2f} um; it touches the pack {times}."
    )


@measures("settle_out", *WHOLE)
def settle_out(context: Context, _claim: Claim) -> Measured:
    """Measure the heights and durations of the rebounds from the backstop after a single pulse."""
    motion, stroke = context.single, context.stroke
    times, x = motion.maxima
    after = x[times > context.returns[0].t_in] - context.position
    bounces = rebounds(motion, context.position)
    value = {
        "largest_excursion_over_stroke": max(float(after.max(initial=0.0)), 0.0) / stroke,
        "rebounds": len(bounces),
        "each_lower": falling([bounce.height for bounce in bounces]),
        "each_shorter": falling([bounce.duration for bounce in bounces]),
        "heights_m": [bounce.height for bounce in bounces],
        "durations_s": [bounce.duration for bounce in bounces],
    }
    share = value["largest_excursion_over_stroke"]
    return Measured(
        value,
        f"{len(bounces)} rebounds, the largest excursion {share:.3f} of the stroke of {stroke * 1e6:.1f} um.",
    )


@measures("low_restitution", *WHOLE)
def low_restitution(context: Context, _claim: Claim) -> Measured:
    """Measure the ratio of rebound speed to impact speed for each backstop impact after a single pulse."""
    left = [(c.v_in, c.v_out) for c in touches(context.single) if c.v_out is not None and c.v_in != 0.0]
    if not left:
        raise NotMeasurableError("The armature never leaves the backstop again after a single pulse")
    ratios = [-v_out / v_in for v_in, v_out in left]
    value = {
        "first_restitution": ratios[0],
        "rank_correlation_with_order": rank_correlation(range(len(ratios)), ratios),
        "restitutions": ratios,
        "speeds_in_m_per_s": [v_in for v_in, _ in left],
    }
    series = ", ".join(f"{ratio:.3f}" for ratio in ratios[:8]) + (", ..." if len(ratios) > 8 else "")
    return Measured(value, f"Ratios of rebound speed to impact speed: {series}.")


@measures("backstop_force_dominates", *WHOLE)
def backstop_force_dominates(context: Context, _claim: Claim) -> Measured:
    """Measure the largest total force on the armature in and outside backstop contacts, after one pulse."""
    motion = context.single

    def total(t: FloatArray) -> FloatArray:
        return np.abs(motion.forces_at(t)["total"])

    contacts = context.returns
    ends = [motion.end if c.t_out is None else c.t_out for c in contacts]
    at_stop = max(largest(total, c.t_in, end) for c, end in zip(contacts, ends, strict=True))
    starts = [motion.start, *ends]
    stops = [*(c.t_in for c in contacts), motion.end]
    elsewhere = max(largest(total, a, b) for a, b in zip(starts, stops, strict=True) if b > a)
    if not elsewhere:
        raise NotMeasurableError("No force acts on the armature outside the backstop")
    value = {"force_ratio": at_stop / elsewhere, "at_backstop_N": at_stop, "elsewhere_N": elsewhere}
    return Measured(value, f"{at_stop:.1f} N in the backstop, {elsewhere:.1f} N at any other time.")


@measures("quiet_look_loud_force", *WHOLE)
def quiet_look_loud_force(context: Context, claim: Claim) -> Measured:
    """Measure the largest backstop force in impacts that follow a rebound too low to be seen."""
    static = float(context.idle.forces_at(0.0)["backstop"][0])
    quiet = claim.settings["quiet_rebound_over_stroke"] * context.stroke
    late = {bounce.end for bounce in rebounds(context.single, context.position) if bounce.height < quiet}
    forces = [c.peak_force for c in touches(context.single) if c.t_in in late and c.peak_force is not None]
    if not forces or not static > 0.0:
        raise NotMeasurableError("No touch with a finite force follows a rebound that low")
    value = {
        "peak_over_static_force": max(forces) / static,
        "peak_force_N": max(forces),
        "static_force_N": static,
    }
    return Measured(
        value,
        f"After a rebound below {quiet * 1e6:.1f} um the force still reaches {max(forces):.1f} N, against"
        f" {static:.1f} N at rest.",
    )


@measures("loops", *WHOLE)
def loops(context: Context, _claim: Claim) -> Measured:
    """Measure the work of each contact on the armature and the energy balance of the single-pulse cycle."""
    motion = context.single
    # The last touch, after which the armature stays at rest, has no closed loop.
    works = [-c.loss for c in motion.contacts if not c.initial and c.t_out is not None]
    losses = [c.loss for c in touches(motion) if c.t_out is not None]
    if not works:
        raise NotMeasurableError("No contact ends after a single pulse")
    energy = motion.energy
    if not energy.throughput:
        raise NotMeasurableError("No energy passes through the hammer after a single pulse")
    total = energy.coil_work + energy.drive_work - energy.pack_loss - energy.backstop_loss
    value = {
        "largest_work_J": max(works),
        "loss_falls": falling(losses),
        "ledger_sum_over_throughput": abs(total) / energy.throughput,
        "backstop_losses_J": losses,
        "coil_work_J": energy.coil_work,
        "pack_loss_J": energy.pack_loss,
        "backstop_loss_J": energy.backstop_loss,
    }
    return Measured(
        value,
        f"Coil work {energy.coil_work * 1e3:.3f} mJ, pack loss {energy.pack_loss * 1e3:.3f} mJ, backstop loss"
        f" {energy.backstop_loss * 1e3:.3f} mJ.",
    )


@measures("print_force", "pack", "waveform")
def print_force(context: Context, _claim: Claim) -> Measured:
    """Measure the peak pack force of the single-pulse dot."""
    force = context.print_force
    return Measured({"peak_force_N": force}, f"The peak force of the dot is {force:.1f} N.")


@measures("pack_energy", "pack", "waveform")
def pack_energy(context: Context, _claim: Claim) -> Measured:
    """Measure the loading work of the single-pulse dot on the pack, and the energy that the pack absorbs."""
    dot = context.dot
    value = {"loading_work_J": dot.loading_work, "net_loss_J": dot.net_loss}
    work, loss = (dot.loading_work or 0.0) * 1e3, (dot.net_loss or 0.0) * 1e3
    return Measured(value, f"Loading work {work:.3f} mJ, of which the pack absorbs {loss:.3f} mJ.")


@measures("delivered_energy", "magnet", "waveform")
def delivered_energy(context: Context, _claim: Claim) -> Measured:
    """Measure the work of the coil per dot in the single-pulse cycle."""
    work = context.single.energy.coil_work
    return Measured({"coil_work_per_dot_J": work}, f"The coil does {work * 1e3:.3f} mJ of work per dot.")


@measures("two_pulses_660us", *WHOLE)
def two_pulses_660us(context: Context, claim: Claim) -> Measured:
    """Measure the largest displacement after the second of two pulses fired 660 us apart.

    According to the paper, the second pulse prints no dot.
    """
    _ = context.dot
    interval = claim.settings["interval_s"]
    motion = context.pulses([0.0, interval], interval + TAIL)
    peak = motion.peak_after(1)
    _, x, v = motion.strobe
    value = {
        "peak_minus_pack_front_m": None if peak is None else peak[1] - context.front,
        "peak_after_firing_m": None if peak is None else peak[1],
        "position_at_firing_m": float(x[1]),
        "velocity_at_firing_m_per_s": float(v[1]),
        "second_coil_work_J": (work := second_coil_work(context, interval)),
    }
    after = "no peak follows" if peak is None else f"the peak after it is {peak[1] * 1e6:.1f} um"
    return Measured(
        value,
        f"Fired again at {x[1] * 1e6:.1f} um with {v[1]:+.3f} m/s: {after}, the pack at"
        f" {context.front * 1e6:.1f} um; the coil does {work * 1e3:+.2f} mJ of work.",
    )


@measures("two_pulses_700us", *WHOLE)
def two_pulses_700us(context: Context, claim: Claim) -> Measured:
    """Measure the dot, coil work and armature velocity of the second of two pulses fired 700 us apart."""
    interval = claim.settings["interval_s"]
    motion = context.pulses([0.0, interval], interval + TAIL)
    first, second = context.dot, motion.dots[1]
    _, x, v = motion.strobe
    back = [
        c for c in touches(motion) if second.flight_time and c.t_in > second.fired_at + second.flight_time
    ]
    ratio = second.peak_force / context.print_force if second.peak_force is not None else None
    gain = None
    if first.flight_time is not None and second.flight_time is not None:
        gain = first.flight_time - second.flight_time
    value = {
        "second_over_first_peak_force": ratio,
        "second_excursion_complete": second.struck and bool(back),
        "velocity_at_half_current_m_per_s": float(motion.at(interval + half_rise(context.waveform))[1][0]),
        "flight_time_gain_s": gain,
        "position_at_firing_m": float(x[1]),
        "velocity_at_firing_m_per_s": float(v[1]),
        "second_coil_work_J": (work := second_coil_work(context, interval)),
    }
    speed = value["velocity_at_half_current_m_per_s"]
    if ratio is None or gain is None:
        return Measured(
            value,
            f"The second pulse prints no dot; at half its current the armature moves at {speed:+.3f} m/s.",
        )
    return Measured(
        value,
        f"The second dot has {ratio:.3f} of the force of the first and flies {gain * 1e6:.1f} us shorter;"
        f" at half its current the armature moves at {speed:+.3f} m/s, and the coil does"
        f" {work * 1e3:+.2f} mJ of work.",
    )


def second_coil_work(context: Context, interval: float) -> float:
    """Compute the coil work [J] on the armature after the second of two firings `interval` [s] apart."""
    both, first = context.pulses([0.0, interval], interval + TAIL), context.pulses([0.0], interval)
    return both.energy.coil_work - first.energy.coil_work


def half_rise(waveform: Waveform) -> float:
    """Compute the time after the firing at which a waveform first reaches half of its peak, s."""
    half = 0.5 * waveform.peak
    start, end = 0.0, waveform.support
    for _ in range(5):
        tau = np.linspace(start, end, 2001)
        there = int(np.argmax(np.abs(waveform.value(tau)) >= half))
        if there == 0:
            return float(tau[0])
        start, end = float(tau[there - 1]), float(tau[there])
    return end


def _requirements() -> tuple[int, tuple[float, float]]:
    """Return the requirements of buzz printing: smallest number of dots, and range of their peak forces.

    The peak forces are relative to the single-pulse dot.
    """
    band = claims()["buzz_printing"].band
    limits = (band["least_force_over_single"]["at_least"], band["largest_force_over_single"]["at_most"])
    return band["dots"]["at_least"], limits


def buzz_search(context: Context) -> BuzzSearch:
    """Search for a pulse train that prints in buzz mode; cache the result in the context."""
    fewest, forces = _requirements()
    return context.once("buzz", lambda: find_buzz_train(context.hammer, fewest=fewest, forces=forces))


def _described(train: BuzzTrain) -> str:
    how = "one every" if train.kind == "uniform" else "each fired after the departure from the pack by"
    return f"{len(train.times)} pulses, {how} {train.interval * 1e6:.1f} us"


@measures("buzz_printing", *WHOLE)
def buzz_printing(context: Context, claim: Claim) -> Measured:
    """Measure the number and peak forces of the dots that the best train prints without backstop contact."""
    search = buzz_search(context)
    train = search.best
    if train is None or not train.count:
        nothing = {**dict.fromkeys(claim.band), "dots": 0, "trains_tried": search.tried}
        return Measured(nothing, f"No train prints in buzz mode: {search.reason}.")
    motion = context.run(PulseTrain(context.waveform, at=train.times), train.times[-1] + TAIL)
    dots = motion.dots[train.first : train.first + train.count]
    returns = [contact.t_in for contact in touches(motion)]
    struck = [dot.fired_at + dot.flight_time for dot in dots if dot.flight_time is not None]
    forces = [dot.peak_force / context.print_force for dot in dots if dot.peak_force is not None]
    value: dict[str, Any] = {
        "dots": len(struck),
        "backstop_touches_before": sum(t < struck[0] for t in returns),
        "backstop_touches_between": sum(struck[0] <= t <= struck[-1] for t in returns),
        "backstop_touches_after": train.touches[2],
        "least_force_over_single": min(forces),
        "largest_force_over_single": max(forces),
        "first_dot": train.first + 1,
        "interval_s": train.interval,
        "train": train.kind,
        "clear_from_the_first_firing": train.clear,
        "trains_tried": search.tried,
    }
    if search.train is None:
        return Measured(
            value, f"The best of {search.tried} trains, {_described(train)}, does not meet the requirements."
        )
    return Measured(
        value,
        f"{_described(train)}: {len(struck)} dots of {min(forces):.2f} to {max(forces):.2f} of the single"
        f" force. {train.touches_text}.",
    )


@measures("buzz_is_delicate", *WHOLE)
def buzz_is_delicate(context: Context, claim: Claim) -> Measured:
    """Count how many of four small changes, of firing interval or pack front, make buzz printing fail."""
    train = buzz_search(context).train
    if train is None:
        return Measured({"cases_broken": None}, "There is no buzz-printing train to perturb.")
    change, shift = claim.settings["interval_change"], claim.settings["pack_front_shift_m"]
    fewest, _ = _requirements()
    counts = {
        f"interval {sign * change:+.0%}": _count(
            context, context.hammer, train, train.interval * (1.0 + sign * change)
        )
        for sign in (-1, 1)
    } | {
        f"pack front {sign * shift * 1e6:+.0f} um": _count(
            context, context.hammer.replace("pack.front", context.front + sign * shift), train, train.interval
        )
        for sign in (-1, 1)
    }
    broken = [name for name, count in counts.items() if count < fewest]
    value = {"cases_broken": len(broken), "dots_left": counts}
    left = ", ".join(f"{count} with {name}" for name, count in counts.items())
    return Measured(value, f"Dots that remain of {train.count}: {left}.")


def _count(context: Context, hammer: Hammer, train: BuzzTrain, interval: float) -> int:
    """Count the dots that a buzz-printing train still prints with another firing interval [s] or hammer."""
    times = tuple(k * interval for k in range(len(train.times)))
    if train.kind != "uniform":
        times = delayed_train(hammer, interval, len(train.times))
    single = context.run(PulseTrain(context.waveform), TAIL, hammer=hammer)
    force = single.dots[0].peak_force
    if not force:
        return 0
    motion = context.attempt(PulseTrain(context.waveform, at=times), times[-1] + TAIL, hammer=hammer)
    return len(longest_run(motion, force, _requirements()[1]).forces)
