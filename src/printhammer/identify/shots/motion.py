"""Fit constants to displacement records of single shots, by multiple shooting between contacts.

With the static forces known, the records determine the mass and the contact laws. Since a motion depends only
on forces over mass, multiplying mass and all forces by a common factor leaves every record unchanged.

The result includes a test of the model and remarks on records and constants.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from printhammer.drive.input import read_positive
from printhammer.errors import InputError, located, nearest
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.uncertainty import Uncertainty
from printhammer.identify.lowpass import time_constant
from printhammer.identify.result import REPLACED, Fit, FittedConstant
from printhammer.identify.shots.approach import Prior
from printhammer.identify.shots.gauss_newton import (
    GaussNewton,
    Solution,
    changes_if_fitted,
    condition_number,
    refuse_degenerate,
    tied_constants,
    weak,
)
from printhammer.identify.shots.shooting import Parameters, Shooting
from printhammer.identify.shots.shot import FEWEST, Pulse, Shot, fit_pulse, read_shot
from printhammer.support.arrays import FloatArray

_REJECTED: Final = 0.01
"""Significance level below which the F-test rejects the model; arbitrary."""
_LARGER: Final = 1.1  # Arbitrary
"""Largest accepted ratio of RMS residual to estimated noise; allows for the error of the estimate."""
_DEGREES: Final = 0.22
"""Degrees of freedom per sample of the noise estimate (median of third differences), from simulated noise."""
_TOLD: Final = 0.05
"""Relative standard error below which the report says that a held constant could be fitted; arbitrary."""
_OFF: Final = 5.0  # Number of standard errors above which a deviation is reported; arbitrary


def tested(shots: Sequence[Shot], solution: Solution, count: int) -> tuple[float, str]:
    """Test the residuals against the noise of the records by an F-test.

    `count` is the number of fitted constants. Return the p-value, and the reason for the rejection of the
    model; the reason is empty if the model is not rejected.
    """
    from scipy.special import fdtrc

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
        ratio = scale / (_LARGER * noise)
        tail = float(fdtrc(max(number - count, 1), _DEGREES * len(shot.x), ratio**2))
        if tail < p_value:
            p_value = tail
            left = np.where(out, 0.0, np.abs(shot.x - shown))
            place = shot.t[int(np.argmax(left))]
            worst = (
                f"the residuals of {shot.name} are {scale:.3g} m, the noise is {noise:.3g} m; the residuals"
                f" are largest at {place:.4g} s (p = {tail:.2g} if the noise is {_LARGER:g} times that)"
            )
    # Bonferroni correction for the number of records.
    p_value = min(1.0, p_value * len(shots))
    return p_value, worst if p_value < _REJECTED else ""


def rests(shots: Sequence[Shot], solution: Solution) -> list[str]:
    """Return remarks on records whose rest position deviates from the rest position of the hammer."""
    sentences = []
    for shot, shown, scale in zip(shots, solution.shown, solution.scales, strict=True):
        before = shot.t < 0.0
        count = int(before.sum())
        if count < FEWEST:
            continue
        off = float(np.median(shot.x[before]) - shown[0])
        if abs(off) > max(_OFF * 1.25 * float(scale) / np.sqrt(count), 0.1 * float(scale)):
            sentences.append(
                f"{shot.name} rests {off:+.2g} m off the rest position of the hammer: an offset of the"
                " sensor, or a backstop of different stiffness or position"
            )
    return sentences


def remembered(shots: Sequence[Shot], solution: Solution) -> list[str]:
    """Return remarks on records with autocorrelated residuals."""
    return [
        f"the residuals of {shot.name} are autocorrelated: {len(shot.t)} samples count as"
        f" {len(shot.t) / memory:.0f}"
        for shot, memory in zip(shots, solution.memories, strict=True)
        if memory > 2.0
    ]


def further(fit: GaussNewton, solution: Solution, hammer: Hammer, rejected: str) -> list[str]:
    """Return remarks on held constants that the records could determine, or that the records contradict.

    `rejected` is the reason for the rejection of the model, or an empty string.
    """
    sentences = ["a motion depends on forces over mass only: the mass is as accurate as the known forces"]
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
    candidates = changes_if_fitted(solution.design, columns, others, left)
    sharp = [f"{name} to {100.0 * error:.2g} %" for name, error, _change in candidates if error < _TOLD]
    if sharp:
        sentences.append(f"with one more constant free, the records would determine {', '.join(sharp)}")
    if rejected and candidates:
        name, error, change = max(candidates, key=lambda entry: abs(entry[2]) / entry[1])
        if abs(change) > _OFF * error:
            sentences.append(
                f"the records most strongly suggest a change of {name}, by {100.0 * change:+.2g} %: fit it,"
                " too, or apply a fit of it"
            )
    return sentences


_DAMPING: Final = "backstop.damping"
_FIRST_GUESS: Final = 0.3
"""Initial guess of the ratio l/k if the hammer has no backstop damping, s/m; arbitrary."""


def fit_motion(
    paths: Sequence[str | Path],
    hammer: Hammer,
    *,
    free: Sequence[str] | None = None,
    robust: bool = True,
    bandwidth: float | str | None = None,
    columns: str | None = None,
    earlier: Sequence[Fit] = (),
) -> Fit:
    """Fit the mass and other constants to displacement records of single shots.

    Every record is divided in free flight between its contacts. Each segment is integrated separately from
    its own initial state; the constants are common, and at the solution each segment begins where the
    preceding one ends (`printhammer.identify.shots.shooting`). The sensor is a first-order low-pass with
    additive noise.

    Parameters
    ----------
    paths : sequence of path
        Records with the columns ``time``, ``displacement`` and optionally ``current``, with units in the
        heading; one shot from rest per file, fired at time 0.
    hammer : Hammer
        Hammer with all other constants and with the initial guesses. Constants with a stated uncertainty,
        `Hammer.uncertainty`, have a Gaussian prior with their covariance; the records refine them, and they
        are among the fitted constants.
    free : sequence of str, optional
        Keys of the constants to fit; by default the mass, and the damping of a Hertz backstop if a record
        touches the backstop.
    robust : bool, optional
        Whether to exclude outliers.
    columns : str, optional
        Contents of the table's columns, such as "time=1, displacement=2*50 um/V"; by default as described in
        a file beside the table, else by its heading; see `printhammer.support.tables.columns`.
    bandwidth : float or str, optional
        Bandwidth of the sensor (-3 dB), Hz; by default the value in a comment ``# bandwidth: 200 kHz`` in the
        record, else unlimited. The current probe is assumed to have the same bandwidth.
    earlier : sequence of Fit, optional
        Fits to apply to the hammer first. For a constant in several fits, the first fit counts.

    Returns
    -------
    Fit
        The fit, of kind "motion"; abscissa and data are times [s] and displacements [m].

    Raises
    ------
    InputError
        A record is invalid, misses the impact, or is too short or too coarse; the hammer's constants were
        already fitted to the record; or a constant is not determined, or not separable from another constant.
    """
    if isinstance(paths, str) or not paths:
        raise InputError.of("paths", paths, "a sequence of at least one record")
    width = None if bandwidth is None else read_positive(bandwidth, "Hz", "bandwidth")
    for each in reversed(earlier):
        hammer = each.into(hammer)
    shots = [read_shot(path, hammer, width, columns) for path in paths]
    records = _check_unused(paths, hammer)
    touched = any(shot.touching("backstop") for shot in shots)
    keys = _free_keys(hammer, free, shots, touched=touched)
    hammer = _plain(hammer, keys)
    pulses, notes = _pulses(hammer, shots)
    known = _known(hammer, own_waveform=None in pulses)
    keys = tuple(dict.fromkeys([*keys, *known.keys]))
    start, parameters, priors, own = _assemble(hammer, keys, pulses, known)
    shooting = Shooting(hammer, shots, own, parameters)
    where = " and ".join(shot.name for shot in shots)
    with located(where):
        fit = GaussNewton(shooting, priors, robust=robust)
    names = (*keys, *(f"the current of {shots[owner].name}" for owner in parameters.owners))
    states = [shot.states for shot in shots]
    refuse_degenerate(where, fit.design(start, states), names)
    with located(where):
        solution = fit.solve(start, states)
    if not touched and hammer.backstop is not None:
        notes.append(
            "no record shows a backstop contact after the shot, so the backstop damping cannot be fitted"
        )
    return replace(_result(hammer, shots, fit, solution, keys, notes), records=records)


def _free_keys(
    hammer: Hammer, free: Sequence[str] | None, shots: Sequence[Shot], *, touched: bool
) -> tuple[str, ...]:
    """Return the keys of the constants to fit; raise `InputError` for a constant that cannot be fitted.

    `touched` states whether any record has a contact with the backstop after the shot.
    """
    hertz = hammer.backstop is not None and hammer.backstop.law == "hertz"
    if free is None:
        return ("mass", _DAMPING) if touched and hertz else ("mass",)
    keys = (free,) if isinstance(free, str) else tuple(free)
    if not keys:
        raise InputError("free: the list is empty", key="free", expected="at least one such as 'mass'")
    where = " and ".join(shot.name for shot in shots)
    for number, key in enumerate(keys):
        if key in keys[:number]:
            raise InputError(f"free: {key} occurs twice", key="free", expected="each constant once")
        given_otherwise = hertz and key in (_DAMPING, "backstop.stiffness")
        if (key not in hammer.constants and not given_otherwise) or key == "platen":
            known = [name for name in hammer.constants if name != "platen"]
            moving = nearest(key, known, "one such as 'mass'")
            raise InputError(
                f"free: {key!r} is not a constant of {hammer.path} that affects the motion",
                key="free",
                expected=moving,
            )
        if key == _DAMPING and not touched:
            raise InputError(
                f"{where}: the record does not touch the backstop after the shot",
                file=where,
                key=key,
                expected=f"a record with a backstop contact, to fit {key}",
            )
        fewest = max((touch.count for shot in shots for touch in shot.touching("backstop")), default=0)
        if key.startswith("backstop.") and touched and fewest < FEWEST:
            raise InputError(
                f"{where}: {fewest} samples in the longest contact with the backstop",
                file=where,
                key=key,
                expected=f"at least {FEWEST} for {key}",
            )
    return keys


def _plain(hammer: Hammer, keys: Sequence[str]) -> Hammer:
    """Return the hammer with explicit backstop stiffness and damping if these constants are fitted."""
    backstop = hammer.backstop
    changes: dict[str, float | None] = {}
    for key, name in (("backstop.stiffness", "k"), (_DAMPING, "l")):
        if key in keys and key not in hammer.constants:
            changes |= {other: None for other in REPLACED[key] if other in hammer.constants}
            changes[key] = getattr(backstop, name, None)
    if _DAMPING in keys and getattr(backstop, "l", None) == 0.0:
        changes[_DAMPING] = _FIRST_GUESS * float(getattr(backstop, "k", 0.0))
    hammer = hammer.replace(changes) if changes else hammer
    for key in keys:
        if hammer.constants[key].si == 0.0:
            raise InputError(
                f"{hammer.path}: {key} is 0",
                file=hammer.path,
                key=key,
                expected="a nonzero initial guess",
            )
    return hammer


def _known(hammer: Hammer, *, own_waveform: bool) -> Uncertainty:
    """Return the uncertainty of the constants that affect the motion.

    `own_waveform` states whether any shot fires the hammer's own waveform, not a recorded current.
    """
    known = hammer.uncertainty or Uncertainty((), np.empty((0, 0)))
    idle = ["platen"] if own_waveform else ["platen", "waveform."]
    if not own_waveform or hammer.waveform is None or hammer.waveform.quantity != "voltage":
        idle.append("coil.")  # With a driver, the coil determines the current.
    return known.without([key for key in known.keys if key.startswith(tuple(idle))])


def _check_unused(paths: Sequence[str | Path], hammer: Hammer) -> tuple[str, ...]:
    """Return the fingerprints of records; raise `InputError` for a record already used for the hammer."""
    prints = tuple(hashlib.sha256(Path(path).read_bytes()).hexdigest()[:16] for path in paths)
    used = hammer.uncertainty.records if hammer.uncertainty is not None else ()
    for path, print_ in zip(paths, prints, strict=True):
        if print_ in used:
            raise InputError(
                f"{path}: the constants of {hammer.path} were fitted to this record already",
                file=path,
                key="record",
                expected="another record, or the hammer from before that fit",
            )
    return prints


def _pulses(hammer: Hammer, shots: Sequence[Shot]) -> tuple[list[Pulse | None], list[str]]:
    """Return the current pulse of each shot (None: the hammer's own waveform), and remarks."""
    pulses: list[Pulse | None] = []
    for shot in shots:
        if shot.current is None:
            if hammer.waveform is None:
                raise InputError(
                    (
                        f"{shot.name}: neither the record has a column 'current [A]' nor {hammer.path} a"
                        " waveform"
                    ),
                    file=shot.name,
                    key="current",
                    expected="a current or a waveform",
                )
            pulses.append(None)
        else:
            tau = time_constant(shot.bandwidth)
            pulses.append(fit_pulse(shot.name, shot.t, shot.current, hammer.waveform, tau))
    return pulses, [pulse.note for pulse in pulses if pulse is not None and pulse.note]


def _assemble(
    hammer: Hammer, keys: tuple[str, ...], pulses: Sequence[Pulse | None], known: Uncertainty
) -> tuple[FloatArray, Parameters, list[Prior], list[Pulse | None]]:
    """Return the initial guess, the parameters, the priors, and the current pulse of each shot.

    `known` is the uncertainty of the hammer's constants, which gives a prior on these constants.
    """
    start = [hammer.constants[key].si for key in keys]
    priors: list[Prior] = []
    if known.keys:
        mean = np.array([hammer.constants[key].si for key in known.keys])
        which = np.array([keys.index(key) for key in known.keys])
        priors.append(Prior(which, mean, _definite(known.covariance, mean)))
    own: list[Pulse | None] = []
    owners: list[int] = []
    common = [key for key in keys if key.startswith("waveform.")]
    for shot, pulse in enumerate(pulses):
        if pulse is None or not pulse.names:
            own.append(pulse)
            continue
        fitted = [f"waveform.{name}" for name in pulse.names]
        if common and all(key in fitted for key in common):
            # The waveform constants are the hammer's; the recorded current gives a prior on them.
            rows = [fitted.index(key) for key in common]
            priors.append(
                Prior(
                    np.array([keys.index(key) for key in common]),
                    pulse.values[rows],
                    _definite(pulse.covariance[np.ix_(rows, rows)], pulse.values[rows]),
                )
            )
            own.append(None)
            continue
        first = len(start)
        start += pulse.values.tolist()
        owners += [shot] * len(pulse.names)
        which = np.arange(first, len(start))
        priors.append(Prior(which, pulse.values, _definite(pulse.covariance, pulse.values)))
        own.append(pulse)
    begin = np.array(start)
    return begin, Parameters(keys, tuple(owners), np.abs(begin)), priors, own


def _definite(covariance: FloatArray, values: FloatArray) -> FloatArray:
    """Regularise a covariance matrix by a small diagonal, so that the matrix can be inverted."""
    return covariance + np.diag((1e-12 * values) ** 2 + 1e-13 * covariance.diagonal())


def _result(
    hammer: Hammer,
    shots: Sequence[Shot],
    fit: GaussNewton,
    solution: Solution,
    keys: tuple[str, ...],
    notes: list[str],
) -> Fit:
    shooting = fit.shooting
    count = len(keys)
    used = [~out for out in solution.outliers]
    informed = sum(float(rows.sum()) / memory for rows, memory in zip(used, solution.memories, strict=True))
    degrees = max(informed - count, 1.0)
    covariance = solution.covariance[:count, :count]
    values = solution.values[:count]
    constants = {
        key: FittedConstant.of(
            key, values[i], float(np.sqrt(covariance[i, i])), degrees, hammer.constants[key].si_unit
        )
        for i, key in enumerate(keys)
    }
    p_value, rejected = tested(shots, solution, count)
    fitted = np.concatenate(solution.shown)
    data = np.concatenate([shot.x for shot in shots])
    precisions = np.concatenate(
        [np.full(len(shot.t), scale**-2.0) for shot, scale in zip(shots, solution.scales, strict=True)]
    )
    given = {
        key: f"{constant.value!r} {constant.unit}"
        for key, constant in hammer.constants.items()
        if key not in keys
        and key != "platen"
        and not (key.startswith("waveform.") and None not in shooting.pulses)
    }
    notes = [
        *notes,
        *rests(shots, solution),
        *remembered(shots, solution),
        *further(fit, solution, hammer, rejected),
    ]
    return Fit(
        kind="motion",
        source=tuple(shot.name.replace("\\", "/").rpartition("/")[2] for shot in shots),
        constants=constants,
        keys=keys,
        covariance=covariance,
        abscissa=np.concatenate([shot.t for shot in shots]),
        data=data,
        fitted=fitted,
        residuals=data - fitted,
        axes=(("time", "s"), ("displacement", "m")),
        degrees_of_freedom=degrees,
        residual_scale=float(np.sqrt(np.mean(solution.scales**2))),
        weights=precisions / precisions.max(),
        outliers=np.concatenate(solution.outliers),
        condition_number=condition_number(solution.design),
        series=np.concatenate([np.full(len(shot.t), number) for number, shot in enumerate(shots)]),
        series_names=tuple(shot.name.replace("\\", "/").rpartition("/")[2] for shot in shots),
        lines=np.concatenate([shot.lines for shot in shots]),
        given=given,
        indistinct=tuple(tied_constants(keys, values, covariance)),
        profiles={keys[which]: fit.profile(solution, which, degrees) for which in weak(values, covariance)},
        rejected=rejected,
        p_value=p_value,
        remarks=tuple(notes),
    )
