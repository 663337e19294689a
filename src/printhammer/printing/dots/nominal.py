"""The single-pulse dot: the reference with which all other dots are compared."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Unpack

from printhammer.drive.trains import PulseTrain
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.results import Declared, scalar
from printhammer.run.effort import DEFAULT, Effort, InThreads, computation
from printhammer.run.ensemble import Ensemble
from printhammer.run.problem import TOLERANCE
from printhammer.run.simulate import simulate
from printhammer.run.waits import waits_of
from printhammer.run.window import wait_of


class SinglePulse(Declared):
    """Reference values of the dot of a single pulse from rest."""

    force: float = scalar("N", "largest pack force")
    flight_time: float = scalar("s", "time from firing to touch")
    extra_contacts: int = scalar(
        "1", "number of extra pack contacts, e.g. from bounces on a stop", default=0, kw_only=True
    )


class Nominal(SinglePulse):
    """Dot of a single pulse from rest, with its speed, indentation and energies."""

    impact_speed: float = scalar("m/s", "impact speed on the pack")
    indentation: float = scalar("m", "largest indentation of the pack")
    loading_work: float = scalar("J", "work done on the pack up to its largest indentation")
    pack_loss: float = scalar("J", "energy dissipated in the pack")


def nominal(hammer: Hammer, waveform: Waveform | None = None, *, tolerance: float = TOLERANCE) -> Nominal:
    """Simulate one pulse from rest and return its dot; `waveform` replaces the hammer's own waveform.

    Raises
    ------
    InputError
        The hammer has no pack, no waveform or no rest state, or a single pulse makes no dot.
    """
    pulse = pulse_of(hammer, waveform)
    if hammer.front is None:
        raise InputError(
            f"{hammer.path}: the hammer has no pack",
            file=hammer.path,
            key="pack",
            expected="a pack, on which a pulse prints a dot",
        )
    if hammer.pack is not None and hammer.pack.rigid:
        raise InputError.of("pack.law", hammer.pack.law, "a pack whose force prints a dot", file=hammer.path)
    motion = simulate(
        hammer, PulseTrain(pulse), duration=wait_of(hammer, pulse), points=2, tolerance=tolerance
    )
    if not motion.ok:
        raise InputError(
            f"{hammer.path}: the run of a single pulse ends early: {motion.message}",
            file=hammer.path,
            key="pulse",
        )
    dot = motion.dots[0]
    values = (dot.peak_force, dot.flight_time, dot.impact_speed, dot.indentation)
    energies = (dot.loading_work, dot.net_loss)
    known = [value for value in (*values, *energies) if value is not None]
    if len(known) < len(values) + len(energies) or not known[0] > 0.0:
        raise InputError(
            f"{hammer.path}: a single pulse makes no dot",
            file=hammer.path,
            key="pulse",
            expected="a pulse that throws the armature into the pack",
        )
    return Nominal(*known, extra_contacts=dot.extra_contacts)


@computation
def single_pulses(
    hammers: Sequence[Hammer],
    waveforms: Sequence[Waveform] | None = None,
    *,
    effort: Effort = DEFAULT,
    **_keywords: Unpack[InThreads],
) -> list[SinglePulse | None]:
    """Simulate one pulse from rest for each of many hammers; return their dots.

    `waveforms` replace the hammers' own waveforms. The entry of a hammer is None if its pulse makes no dot or
    its simulation ended early. Every hammer needs a pack.
    """
    if not hammers:
        return []
    pulses = [pulse_of(hammer) for hammer in hammers] if waveforms is None else waveforms
    drives = [PulseTrain(pulse) for pulse in pulses]
    waits = waits_of(hammers, pulses, effort.threads)
    result = Ensemble(list(hammers), drives, waits, tolerance=effort.tolerance).run(
        dots=True, threads=effort.threads
    )
    dots = result.dots
    assert dots is not None
    good = result.ok & dots.struck[:, 0]
    forces, flights = dots.peak_force[:, 0].tolist(), dots.flight_time[:, 0].tolist()
    more = dots.extra_contacts[:, 0].tolist()
    return [
        SinglePulse(force, flight, extra_contacts=extra) if well and force > 0.0 else None
        for well, force, flight, extra in zip(good.tolist(), forces, flights, more, strict=True)
    ]


def pulse_of(hammer: Hammer, waveform: Waveform | None = None) -> Waveform:
    """Return `waveform` or, by default, the waveform of the hammer."""
    pulse = hammer.waveform if waveform is None else waveform
    if pulse is None:
        raise InputError(
            f"{hammer.path}: the hammer has no [waveform] to fire",
            file=hammer.path,
            key="waveform",
            expected="one",
        )
    return pulse
