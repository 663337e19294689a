"""Claim about the accuracy and stability of the two integrators of the 1983 paper."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from printhammer.claims.context import Context
from printhammer.claims.judging import WHOLE, Claim, Measured, measures
from printhammer.drive.trains import PulseTrain
from printhammer.hammer.equilibrium import equilibria
from printhammer.run.motion import Motion

REFERENCE_TOLERANCE: Final = 1e-13
"""Tolerance of the reference motion, well below the errors of 1983; arbitrary."""
_CYCLE: Final = 10e-3
"""Duration of the simulated single-pulse cycle, s; the motion has settled by then; arbitrary."""
_SETTLED: Final = 0.01  # Largest late error of a scheme that completes the cycle, in strokes; arbitrary
_RATIO: Final = 2.0**0.25  # Ratio of successive factors on the step sizes; arbitrary
_LARGEST: Final = 32.0  # Largest factor on the step sizes; arbitrary
_RUNGE_KUTTA_LIMIT: Final = math.sqrt(8.0)


@measures("integrator_comparison", *WHOLE)
def integrator_comparison(context: Context, claim: Claim) -> Measured:
    """Measure the error of both integrators at the paper's step sizes, and the step sizes at which they fail.

    The step sizes are given as a factor on the paper's step sizes.
    """
    reference = context.run(PulseTrain(context.waveform), _CYCLE, tolerance=REFERENCE_TOLERANCE)
    trapezoid, runge_kutta = (_scheme(context, name, 1.0) for name in ("trapezoid", "runge-kutta-4"))
    errors = {motion: _error(motion, reference) for motion in (trapezoid, runge_kutta)}
    fails = {name: _failing_scale(context, reference, name) for name in ("trapezoid", "runge-kutta-4")}
    still = min(equilibria(context.hammer), key=lambda state: abs(state.x - context.rest), default=None)
    phase = None
    if still is not None and still.frequency is not None:
        phase = 2.0 * math.pi * still.frequency * claim.settings["late_settle_step_s"]
    value = {
        "trapezoid_completes": _completes(context, trapezoid, reference),
        "runge_kutta_completes": _completes(context, runge_kutta, reference),
        "runge_kutta_error_over_trapezoid": errors[runge_kutta] / errors[trapezoid]
        if errors[trapezoid]
        else None,
        "failing_scale_ratio": fails["runge-kutta-4"] / fails["trapezoid"],
        "trapezoid_error_m": errors[trapezoid],
        "runge_kutta_error_m": errors[runge_kutta],
        "trapezoid_fails_at_scale": fails["trapezoid"],
        "runge_kutta_fails_at_scale": fails["runge-kutta-4"],
        "late_step_phase": phase,
        "late_step_stable_for_runge_kutta": None if phase is None else phase <= _RUNGE_KUTTA_LIMIT,
    }
    last = ""
    if phase is not None:
        state = "stable" if phase <= _RUNGE_KUTTA_LIMIT else "unstable"
        last = f"; the last step size, {phase:.2f} rad of the oscillation at rest, is {state} for Runge-Kutta"
    return Measured(
        value,
        f"Errors {errors[trapezoid] * 1e6:.2f} um (trapezoidal) and {errors[runge_kutta] * 1e6:.2f} um"
        f" (Runge-Kutta); with steps scaled up they fail at {fails['trapezoid']:.3g} and"
        f" {fails['runge-kutta-4']:.3g} times the schedule{last}.",
    )


def _scheme(context: Context, name: str, scale: float) -> Motion:
    return context.attempt(PulseTrain(context.waveform), _CYCLE, scheme=name, step_scale=scale)


def _error(motion: Motion, reference: Motion) -> float:
    """Compute the largest displacement error of a motion at its integration steps, against a reference, m."""
    times = motion.step_times
    return float(np.abs(motion.at(times)[0] - reference.at(times)[0]).max())


def _completes(context: Context, motion: Motion, reference: Motion) -> bool:
    """Whether a scheme completes the cycle, makes one pack contact, and ends close to the reference."""
    if not motion.ok or sum(c.surface == "pack" for c in motion.contacts) != 1:
        return False
    times = motion.step_times[motion.step_times >= 0.5 * _CYCLE]
    late = np.abs(motion.at(times)[0] - reference.at(times)[0]).max()
    return bool(late < _SETTLED * context.stroke)


def _failing_scale(context: Context, reference: Motion, name: str) -> float:
    """Find the smallest tested factor on the paper's step sizes at which the scheme `name` fails."""
    scale = 1.0
    while scale < _LARGEST and _completes(context, _scheme(context, name, scale), reference):
        scale *= _RATIO
    return scale
