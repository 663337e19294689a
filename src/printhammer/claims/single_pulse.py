"""Claims about the single pulse: stroke, settle-out, forces, loops, energies."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from printhammer.claims.context import Context, NotMeasurableError
from printhammer.claims.judging import WHOLE, Measured, measures
from printhammer.claims.shapes import falling, largest, rank_correlation
from printhammer.printing.dots.settling import rebounds, touches

if TYPE_CHECKING:
    from printhammer.claims.definition import Claim
    from printhammer.support.arrays import FloatArray


@measures("single_pulse_stroke", "pack", "waveform")
def single_pulse_stroke(context: Context, _claim: Claim) -> Measured:
    """Largest displacement and number of pack contacts after one pulse."""
    contacts = sum(c.surface == "pack" and not c.initial for c in context.single.contacts)
    value = {"max_displacement_m": context.peak, "contacts_with_pack": contacts}
    times = {1: "once"}.get(contacts, f"{contacts} times")
    return Measured(
        value, f"One pulse lifts the armature to {context.peak * 1e6:.2f} um; it touches the pack {times}."
    )


@measures("settle_out", *WHOLE)
def settle_out(context: Context, _claim: Claim) -> Measured:
    """Rebounds after the first backstop touch."""
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
    """Speed ratios out/in of the backstop touches."""
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
    return Measured(value, f"Speed ratios from touch to touch: {series}.")


@measures("backstop_force_dominates", *WHOLE)
def backstop_force_dominates(context: Context, _claim: Claim) -> Measured:
    """Largest total force during backstop touches, and at any other time of the cycle."""
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
    """Largest backstop force in touches that follow a rebound too low to be seen."""
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
        f"After a rebound below {quiet * 1e6:.1f} um still {max(forces):.1f} N, against {static:.1f} N"
        " at rest.",
    )


@measures("loops", *WHOLE)
def loops(context: Context, _claim: Claim) -> Measured:
    """Work of every contact on the armature; the ledger from rest to rest."""
    motion = context.single
    # The last touch, in which the armature stays, closes no loop.
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
        f"The coil gives {energy.coil_work * 1e3:.3f} mJ, the pack takes {energy.pack_loss * 1e3:.3f} mJ,"
        f" the backstop {energy.backstop_loss * 1e3:.3f} mJ.",
    )


@measures("print_force", "pack", "waveform")
def print_force(context: Context, _claim: Claim) -> Measured:
    """Peak force of the single-pulse dot."""
    force = context.print_force
    return Measured({"peak_force_N": force}, f"The dot is printed with {force:.1f} N.")


@measures("pack_energy", "pack", "waveform")
def pack_energy(context: Context, _claim: Claim) -> Measured:
    """Work done on the pack by the single-pulse dot, and what it keeps."""
    dot = context.dot
    value = {"loading_work_J": dot.loading_work, "net_loss_J": dot.net_loss}
    work, loss = (dot.loading_work or 0.0) * 1e3, (dot.net_loss or 0.0) * 1e3
    return Measured(value, f"Of {work:.3f} mJ put into it the pack keeps {loss:.3f} mJ.")


@measures("delivered_energy", "magnet", "waveform")
def delivered_energy(context: Context, _claim: Claim) -> Measured:
    """Coil work of the single-pulse cycle."""
    work = context.single.energy.coil_work
    return Measured({"coil_work_per_dot_J": work}, f"The coil gives {work * 1e3:.3f} mJ.")
