"""Plausibility checks of a data sheet: mass, size, saturation and energy of the magnet; contact times."""

from __future__ import annotations

import math
from typing import Final

from printhammer.hammer.hammer import Hammer
from printhammer.identify.datasheet.sheet import LIMITS, DataSheet
from printhammer.parts.magnet import reluctance as law
from printhammer.parts.magnet.reluctance import MU0, ReluctanceMagnet

IRON: Final = 7860.0  # Density of iron, kg/m^3: textbook value
_HEAVY: Final = 3.0  # Ratio of required to stated armature mass above which a fit is implausible; arbitrary

SATURATION: Final = 2.2
"""Flux density, T, that no soft-iron core exceeds: the textbook value of pure iron, 2.15 T, rounded up."""

INTERRUPTED: Final = 20.0
"""Voltage of the interrupted coil, relative to the rail, in the check of the release time; arbitrary."""


def implausible(sheet: DataSheet, part: ReluctanceMagnet) -> list[str]:
    """List the physically implausible properties of a fitted magnet, one sentence each.

    Four properties are checked:

    - Mass: an iron disc that covers the fitted pole area, taken as a circle, and carries the flux to its rim
      is a quarter of the circle's diameter thick. The disc must not be much heavier than the armature.
    - Size: the circle must fit into the smallest side or diameter of the device, `size`.
    - Saturation: a pole of area A holds at most B^2 A / (2 mu0), with the saturation flux density B of iron.
    - Energy: the driver must be able to supply the field energy at full gap, L I^2 / 2, within one pulse. I
      is the current at which the data sheet specifies the forces, and a pulse supplies at most rail voltage
      times I times on-time.
    """
    found = []
    diameter = 2.0 * math.sqrt(part.pole_area / math.pi)
    least, mass = IRON * part.pole_area * 0.25 * diameter, sheet.si("mass")
    if "pole_diameter" not in sheet.entries and least > _HEAVY * mass:
        found.append(
            f"the fitted pole area is {1e4 * part.pole_area:.3g} cm2: an iron armature for it weighs at least"
            f" {1e3 * least:.3g} g, but the sheet states {1e3 * mass:.3g} g; check force, gap and current"
        )
    if diameter > sheet.si("size", math.inf):
        found.append(
            f"a round pole of {1e4 * part.pole_area:.3g} cm2 is {1e3 * diameter:.3g} mm wide, but the device"
            f" only {1e3 * sheet.si('size'):.3g} mm; check force, gap and current"
        )
    strongest = max(force.si for _gap, force in sheet.force)
    holding = SATURATION**2 * part.pole_area / (2.0 * MU0)
    if strongest > holding:
        found.append(
            f"the force of {strongest:.3g} N exceeds the {holding:.3g} N of a saturated iron pole of"
            f" {1e4 * part.pole_area:.3g} cm2; check force and pole_diameter"
        )
    current = sheet.si("current", sheet.si("rail") / sheet.si("resistance"))
    field = 0.5 * law.magnet_inductance(part.packed(0.0), 0.0, 0.0) * current**2
    supplied = sheet.si("rail") * current * sheet.si("on_time")
    if field > supplied:
        found.append(
            f"the field energy at {current:.3g} A is {1e3 * field:.3g} mJ, but a pulse supplies at most"
            f" {1e3 * supplied:.3g} mJ: check force, gap, current and on_time"
        )
    return found


def missed_limits(sheet: DataSheet, hammer: Hammer) -> list[str]:
    """List the limits of operate, release and bounce time that the contacts of a hammer exceed.

    The coil is switched to the rail, and then interrupted: data sheets rarely state the circuit in which the
    release time was measured, and a coil without a diode is assumed. The bounce time is that of the contact
    that closes.
    """
    limits = [name for name in LIMITS if name in sheet.entries]
    if not limits:
        return []
    from printhammer.drive.trains import PulseTrain
    from printhammer.drive.waveforms.drivers import Rail
    from printhammer.run.simulate import simulate

    rail, width = sheet.si("rail"), float(getattr(hammer.waveform, "width", math.nan))
    wave = Rail(voltage=rail, width=width, decay="zener", decay_voltage=INTERRUPTED * rail)
    missed = []
    for timing in simulate(hammer, PulseTrain(wave)).timings:
        closing = timing.operate_bounce if timing.kind == "make" else timing.release_bounce
        measured = {
            "operate_time": timing.operate_time,
            "release_time": timing.release_time,
            "bounce_time": closing,
        }
        if all(measured[name] is None for name in limits):
            missed.append(f"the {timing.contact} contact does not switch, so that its times are unknown")
            continue
        for name in limits:
            what, limit, value = name.replace("_", " "), sheet.si(name), measured[name]
            if value is None:
                missed.append(f"the {timing.contact} contact does not switch, so that it has no {what}")
            elif value > limit:
                missed.append(
                    f"the {what} of the {timing.contact} contact is {1e3 * value:.3g} ms, but at most"
                    f" {1e3 * limit:.3g} ms are stated"
                )
    return missed
