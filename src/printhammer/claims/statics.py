"""Claims about statics: geometry, rest state, magnet and spring forces, and current range.

The claim about elastomer backstops is included.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from printhammer.claims.context import CYCLE, Context, NotMeasurableError
from printhammer.claims.judging import WHOLE, Claim, Measured, claims, measures
from printhammer.drive.trains import PulseTrain
from printhammer.hammer.equilibrium import equilibria, holding_margin, positive_intervals
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.static_force import StaticForce
from printhammer.run.motion import Motion


@measures("geometry", "backstop", "pack", "platen")
def geometry(context: Context, _claim: Claim) -> Measured:
    """Measure the positions of backstop, pack and platen, and the thickness of the pack."""
    platen = float(context.need("platen"))
    way = platen - context.front
    thickness = float(getattr(context.hammer.pack, "thickness", way))
    value = {
        "backstop_m": context.position,
        "pack_front_m": context.front,
        "platen_m": platen,
        "pack_thickness_m": thickness,
    }
    return Measured(
        value, f"The pack is {thickness * 1e6:.1f} um thick, its front {way * 1e6:.1f} um before the platen."
    )


@measures("rest_state", "magnet", "backstop", "waveform")
def rest_state(context: Context, _claim: Claim) -> Measured:
    """Measure compression of the backstop, residual force and stability of the armature at rest."""
    rest = context.rest
    force = float(context.idle.forces_at(0.0)["total"][0])
    equilibrium = min(equilibria(context.hammer), key=lambda e: abs(e.x - rest), default=None)
    here = equilibrium is not None and abs(equilibrium.x - rest) <= 1e-9 * abs(rest)
    depth = context.position - rest
    value = {
        "depth_m": depth,
        "total_force_N": abs(force),
        "stable": bool(here and equilibrium is not None and equilibrium.stable),
        "rest_m": rest,
        "natural_frequency_Hz": equilibrium.frequency if here and equilibrium is not None else None,
    }
    return Measured(value, f"At rest the backstop is compressed by {depth * 1e6:.3f} um.")


@measures("return_from_everywhere", "magnet", "spring", "backstop", "platen")
def return_from_everywhere(context: Context, _claim: Claim) -> Measured:
    """Measure the largest net force of magnet and spring between backstop and platen, at zero current."""
    platen = float(context.need("platen"))
    start, end = context.position, platen
    best_x, best = start, -np.inf
    for _ in range(6):
        x = np.linspace(start, end, 2001)
        net = -holding_margin(context.hammer, x)
        if not np.isfinite(net).all():
            raise NotMeasurableError("The law of the magnet does not hold all the way to the platen")
        top = int(np.argmax(net))
        if net[top] > best:
            best_x, best = float(x[top]), float(net[top])
        start, end = float(x[max(top - 1, 0)]), float(x[min(top + 1, 2000)])
    intervals = [list(ends) for ends in positive_intervals(context.hammer) if ends[0] < platen]
    value = {"largest_net_force_N": best, "at_m": best_x, "positive_from_to_m": intervals}
    detail = f"The net force is largest at {best_x * 1e6:.1f} um, {best:+.3g} N."
    return Measured(value, detail)


@measures("release_margin", "magnet", "spring", "backstop")
def release_margin(context: Context, _claim: Claim) -> Measured:
    """Measure the net force of magnet and spring at the backstop, without current, over the magnet force."""
    force = StaticForce(context.hammer)
    magnet, spring = force.magnet(context.position), force.spring(context.position)
    if magnet == 0.0:
        raise NotMeasurableError("The magnet has no force at the backstop")
    value = {
        "net_over_magnet_force": abs(spring + magnet) / abs(magnet),
        "net_force_N": spring + magnet,
        "magnet_force_N": magnet,
        "spring_force_N": spring,
    }
    detail = f"The spring leaves {abs(spring + magnet):.2f} N of the magnet force of {abs(magnet):.2f} N."
    return Measured(value, detail)


@measures("current_range", "magnet", "waveform")
def current_range(context: Context, _claim: Claim) -> Measured:
    """Measure the largest coil current in the paper's drives: single pulse, pulse pairs and trains."""
    waveform = context.waveform
    if waveform.quantity != "current":
        raise NotMeasurableError(f"The hammer is driven by a {waveform.quantity}, not by a current")
    settings = {name: claim.settings for name, claim in claims().items()}
    drives = [PulseTrain(waveform)]
    drives += [
        PulseTrain(waveform, at=[0.0, settings[f"two_pulses_{us}us"]["interval_s"]]) for us in (660, 700)
    ]
    drives += [
        PulseTrain(waveform, period=period, pulses=9) for period in settings["poincare"]["strobe_times_s"]
    ]
    largest = max(drive.peak for drive in drives)
    strong, coil = getattr(context.hammer.magnet, "Am", None), getattr(context.hammer.magnet, "Bm", None)
    value = {
        "largest_current_A": largest,
        "Am_over_Bm_A": strong / coil if strong is not None and coil else None,
        "single_pulse_current_A": waveform.peak,
    }
    law = (
        "the magnet's law has no Am and Bm"
        if strong is None or not coil
        else f"Am / Bm = {strong / coil:.3g} A"
    )
    return Measured(
        value, f"The largest current of pulse, pairs and trains down to 0.80 ms is {largest:.3g} A; {law}."
    )


_NEVER: Final = 1.0
"""Firing time later than the end of every run, s, so that no current flows in the run; arbitrary."""


@measures("elastomer_backstop", *WHOLE)
def elastomer_backstop(context: Context, claim: Claim) -> Measured:
    """Count the rebounds from the hammer's backstop and from an elastomer backstop, at equal impact speed."""
    settings = claim.settings
    speed = context.returns[0].v_in
    hard_impact = _impact(context, context.hammer, speed)
    if not hard_impact.ok:
        raise NotMeasurableError(f"The impact on the backstop did not end: {hard_impact.message}")
    hard = _rebounds(hard_impact)
    crushed = []
    # Choose the softest elastomer that stops the armature within the range of the magnet's law.
    for force in settings["forces_N"]:
        part = {
            "law": "elastomer",
            "position": context.position,
            "stiffness": force / settings["deformation_m"] ** 1.5,
            "relaxation_time": settings["relaxation_time_s"],
        }
        motion = _impact(context, context.hammer.replace("backstop", part), speed)
        if not motion.ok:
            crushed.append(force)
            continue
        count = _rebounds(motion)
        value: dict[str, Any] = {
            "fewer_rebounds": hard - count,
            "rebounds_hard": hard,
            "rebounds_elastomer": count,
            "impact_speed_m_per_s": speed,
            "force_at_25_um_N": force,
            "relaxation_time_s": settings["relaxation_time_s"],
            "largest_deformation_m": max(c.depth for c in motion.contacts),
            "too_soft_N": crushed,
        }
        return Measured(
            value,
            f"{count} rebounds from an elastomer that deforms by 25 um at {force:.1f} N, {hard} from the"
            " backstop of this hammer.",
        )
    raise NotMeasurableError("No elastomer that deforms by 25 um at a few pounds stops this armature")


def _impact(context: Context, hammer: Hammer, speed: float) -> Motion:
    """Simulate the impact of the armature on the backstop at a given speed [m/s], without current."""
    drive = PulseTrain(context.waveform, at=[_NEVER])
    return context.attempt(drive, CYCLE, hammer=hammer, state=(context.position, speed))


def _rebounds(motion: Motion) -> int:
    return sum(c.surface == "backstop" and c.t_out is not None for c in motion.contacts)
