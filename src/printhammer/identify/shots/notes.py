"""What to say beside the constants that records of motion give: a test of the model, and what is odd."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from printhammer.hammer.hammer import Hammer
from printhammer.identify.shots.gauss_newton import GaussNewton, Solution, would_be_found
from printhammer.identify.shots.shooting import Parameters, Shooting
from printhammer.identify.shots.shot import FEWEST, Shot

_REJECTED: Final = 0.01
"""Probability below which the model is rejected."""
_LARGER: Final = 1.1
"""Residuals over noise, at least, where the model is rejected: the noise of a record is not known better."""
_DEGREES: Final = 0.22
"""Degrees of freedom, a sample, of a noise from the median of third differences of white noise."""
_TOLD: Final = 0.05
"""Relative standard error up to which a constant that was held is named as one that could be found."""
_OFF: Final = 5.0


def tested(shots: Sequence[Shot], solution: Solution, count: int) -> tuple[float, str]:
    """Compare the residuals with the noise that the records show by themselves."""
    from scipy.stats import f

    p_value, worst = 1.0, ""
    for shot, scale, out, shown in zip(
        shots, solution.scales, solution.outliers, solution.shown, strict=True
    ):
        noise = shot.noise
        before = shot.x[shot.t < 0.0]
        if len(before) >= 30:
            noise = max(noise, float(np.std(before, ddof=1)))
        steps = np.diff(np.unique(shot.x))
        resolution = float(steps.min()) if len(steps) else 0.0
        noise = max(noise, resolution / np.sqrt(12.0))
        if noise == 0.0:
            continue
        number = int((~out).sum())
        tail = float(f.sf((scale / noise) ** 2, max(number - count, 1), _DEGREES * len(shot.x)))
        if tail < p_value:
            p_value = tail
            if scale > _LARGER * noise:
                left = np.where(out, 0.0, np.abs(shot.x - shown))
                place = shot.t[int(np.argmax(left))]
                worst = (
                    f"the residuals of {shot.name} are {scale:.3g} m, its noise is {noise:.3g} m, and they"
                    f" are largest at {place:.4g} s (p = {tail:.2g})"
                )
    # The largest of several records counts.
    p_value = min(1.0, p_value * len(shots))
    return p_value, worst if p_value < _REJECTED else ""


def rests(shots: Sequence[Shot], solution: Solution) -> list[str]:
    """Say where a record does not rest where the hammer does."""
    sentences = []
    for shot, shown, scale in zip(shots, solution.shown, solution.scales, strict=True):
        before = shot.t < 0.0
        count = int(before.sum())
        if count < FEWEST:
            continue
        off = float(np.median(shot.x[before]) - shown[0])
        if abs(off) > max(_OFF * 1.25 * float(scale) / np.sqrt(count), 0.1 * float(scale)):
            sentences.append(
                f"{shot.name} rests {off:+.2g} m from where the hammer does: an offset of the sensor, or a"
                " backstop of another stiffness or position"
            )
    return sentences


def remembered(shots: Sequence[Shot], solution: Solution) -> list[str]:
    """Say where residuals are not independent of each other."""
    return [
        f"the residuals of {shot.name} depend on each other: {len(shot.t)} samples count as"
        f" {len(shot.t) / memory:.0f}"
        for shot, memory in zip(shots, solution.memories, strict=True)
        if memory > 2.0
    ]


def further(fit: GaussNewton, solution: Solution, hammer: Hammer, rejected: str) -> list[str]:
    """Say which of the constants held the records could determine too, and which they contradict."""
    sentences = [
        "a motion shows forces divided by the mass only: the mass is as sure as the forces taken as known"
    ]
    shooting = fit.shooting
    parameters = shooting.parameters
    recorded = None not in shooting.pulses
    others = tuple(
        key
        for key, constant in hammer.constants.items()
        if key not in parameters.keys
        and key != "platen"
        and constant.si
        and not (recorded and key.startswith("waveform."))
    )
    if not others:
        return sentences
    values = np.array([hammer.constants[key].si for key in others])
    wide = Parameters(others, (), np.abs(values))
    pulses = [
        None if pulse is None else pulse.at(solution.values[parameters.of_shot(shot)].tolist())
        for shot, pulse in enumerate(shooting.pulses)
    ]
    base = shooting.hammer_at(solution.values)
    other = Shooting(base, shooting.shots, pulses, wide)
    chains = other.chains(values, solution.states, derivatives=True)
    if chains is None:
        return sentences
    rows, residuals = [], []
    for shot, chain in enumerate(chains):
        _shown, jacobian, *_rest = other.condensed(shot, chain)
        size = float(solution.scales[shot] * np.sqrt(solution.memories[shot]))
        keep = (~solution.outliers[shot])[:, np.newaxis] / size
        rows.append(jacobian * keep)
        residuals.append((shooting.shots[shot].x - solution.shown[shot]) * keep[:, 0])
    below = len(solution.design) - sum(len(row) for row in rows)
    columns = np.concatenate([*rows, np.zeros((below, len(others)))])
    left = np.concatenate([*residuals, np.zeros(below)])
    candidates = would_be_found(solution.design, columns, others, left)
    sharp = [f"{name} to {100.0 * error:.2g} %" for name, error, _change in candidates if error < _TOLD]
    if sharp:
        sentences.append(f"with one more constant free, the records would determine {', '.join(sharp)}")
    if rejected and candidates:
        name, error, change = max(candidates, key=lambda entry: abs(entry[2]) / entry[1])
        if abs(change) > _OFF * error:
            sentences.append(
                f"the records ask most for another {name}, by {100.0 * change:+.2g} %: free it, or give its"
                " fit"
            )
    return sentences
