"""The claim about backstops of an elastomer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from printhammer.claims.context import CYCLE, Context, NotMeasurableError
from printhammer.claims.judging import WHOLE, Measured, measures
from printhammer.drive.trains import PulseTrain

if TYPE_CHECKING:
    from printhammer.claims.definition import Claim
    from printhammer.hammer.hammer import Hammer
    from printhammer.run.motion import Motion

_NEVER: Final = 1.0
"""A firing time after the end of every run, s."""


@measures("elastomer_backstop", *WHOLE)
def elastomer_backstop(context: Context, claim: Claim) -> Measured:
    """Rebounds from the backstop of the hammer and from an elastomer, at the speed of the first touch."""
    settings = claim.settings
    speed = context.returns[0].v_in
    hard_impact = _impact(context, context.hammer, speed)
    if not hard_impact.ok:
        raise NotMeasurableError(f"The impact on the backstop did not end: {hard_impact.message}")
    hard = _rebounds(hard_impact)
    crushed = []
    # The softest that stops the armature before it leaves the range in which the magnet's law holds.
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
    """Let a hammer hit its backstop at a speed, m/s, without current."""
    drive = PulseTrain(context.waveform, at=[_NEVER])
    return context.attempt(drive, CYCLE, hammer=hammer, state=(context.position, speed))


def _rebounds(motion: Motion) -> int:
    return sum(c.surface == "backstop" and c.t_out is not None for c in motion.contacts)
