"""Displacement record of a single shot: reading, contact detection, and division into segments.

The record is divided in free flight, midway between contacts, where a local parabola gives displacement and
velocity as initial guesses for the integration of the next segment. The current of the shot is either the
hammer's waveform, fitted to the recorded current, or the recorded current.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from printhammer.drive.segments import evaluate
from printhammer.drive.waveforms.shapes import Sampled, Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.identify.lowpass import bandwidth_of, lowpass_waveform
from printhammer.identify.noise import noise_of_record, outliers_of, robust_scale, running_median
from printhammer.results import Declared, part, scalar
from printhammer.support.arrays import FloatArray, IntArray
from printhammer.support.constants import quantities
from printhammer.support.tables.readings import read_table
from printhammer.units import from_si

Surface = Literal["pack", "backstop"]

FEWEST: Final = 5
"""Smallest number of samples in a detected contact; arbitrary."""
_CLEAR: Final = 0.005  # Arbitrary
"""Distance from a surface, as a fraction of the stroke, that confirms the beginning or end of a contact."""
_WINDOW: Final = 15e-6
"""Longest averaging time for contact detection, s; shorter than any contact. Arbitrary."""


class Touch(Declared):
    """Contact with backstop or pack, detected in a record."""

    surface: Surface = part('either "pack" or "backstop"')
    first: int = part("index of the first sample")
    last: int = part("index of the last sample")

    @property
    def count(self) -> int:
        """Number of samples in the contact."""
        return self.last - self.first + 1


class Shot(Declared, eq=False):
    """Displacement record of one shot, with its contacts and segment joints."""

    name: str = part("file name, for messages")
    t: FloatArray = part("times of the samples, s, ascending, 0 at the firing, shape (n,)")
    x: FloatArray = part("displacements, m, shape (n,)")
    current: FloatArray | None = part("current, A, shape (n,); None if not recorded")
    lines: IntArray = part("line number of each sample in the file, shape (n,)")
    bandwidth: float | None = scalar("Hz", "bandwidth of the sensor", more="None for unlimited")
    noise: float = part("noise of the displacement, m, estimated from differences of the samples")
    touches: list[Touch] = part("contacts in order; the first is the rest at the backstop, if recorded")
    joints: IntArray = part("sample indices at which the record is divided into segments, shape (j,)")
    states: FloatArray = part(
        "displacement [m] and velocity [m/s] at the joints, estimated from the record. Shape (j, 2)"
    )

    def touching(self, surface: Surface) -> list[Touch]:
        """Return the contacts with the pack or the backstop, except a contact at the start of the record."""
        return [touch for touch in self.touches if touch.surface == surface and touch.first > 0]


def read_shot(
    path: str | Path, hammer: Hammer, bandwidth: float | None = None, columns: str | None = None
) -> Shot:
    """Read the record of a single shot and detect its contacts.

    Parameters
    ----------
    path : path
        CSV file with the columns ``time``, ``displacement`` and optionally ``current``, units in the heading.
    hammer : Hammer
        Hammer whose backstop and pack define the surfaces.
    bandwidth : float, optional
        Bandwidth of the sensor, Hz; by default the value in a comment ``# bandwidth: 200 kHz``, else
        unlimited.
    columns : str, optional
        Contents of the table's columns, as in `printhammer.identify.shots.motion.fit_motion`.

    Raises
    ------
    InputError
        The file is invalid, times do not ascend, the record begins too late or ends too early, misses the
        impact, or has too few samples during the impact.
    """
    table = read_table(path, {"time": "s", "displacement": "m"}, optional={"current": "A"}, columns=columns)
    name, t, x = str(table.path), table.values["time"], table.values["displacement"]
    table.check_times()
    if len(t) < 4 * FEWEST:
        raise InputError(
            f"{name}: {len(t)} samples",
            file=name,
            key="samples",
            expected=f"the record of a whole shot, at least {4 * FEWEST} samples",
        )
    noise = noise_of_record(x)
    touches, smooth, clear = find_touches(t, x, noise, hammer)
    _check(name, t, smooth, clear, touches, hammer)
    between = list(pairwise(touches))
    joints = [(a.last + b.first) // 2 for a, b in between]
    reach = [max(2, (b.first - a.last) // 2) for a, b in between]
    local = [_state(t, x, row, near, noise) for row, near in zip(joints, reach, strict=True)]
    return Shot(
        name=name,
        t=t,
        x=x,
        current=table.values.get("current"),
        lines=table.lines,
        bandwidth=bandwidth_of(table) if bandwidth is None else bandwidth,
        noise=noise,
        touches=touches,
        joints=np.array(joints, dtype=np.int64),
        states=np.array(local).reshape(-1, 2),
    )


def find_touches(
    t: FloatArray, x: FloatArray, noise: float, hammer: Hammer
) -> tuple[list[Touch], FloatArray, float]:
    """Detect the contacts in a record; return contacts, smoothed record and detection threshold, m.

    A contact lasts from the crossing of the surface by the smoothed record to the crossing back; excursions
    within the threshold, to either side, are ignored. A hard pack may yield by less than `_CLEAR` of the
    stroke: if no contact with the pack is deeper than the threshold, the threshold for the pack is lowered to
    the noise or to half of the largest depth (arbitrary), whichever is larger.
    """
    stroke = stroke_of(hammer, x)
    wanted = (noise / (0.25 * _CLEAR * stroke)) ** 2
    width = int(min(max(wanted, 1.0), max(_WINDOW / float(np.median(np.diff(t))), 1.0)))
    smooth = _smoothed(running_median(x, 5 if 5 * float(np.median(np.diff(t))) < _WINDOW else 3), width | 1)
    noisy = 4.0 * noise / np.sqrt(width | 1)
    clear = max(noisy, _CLEAR * stroke)
    levels: list[tuple[Surface, FloatArray]] = []
    if hammer.position is not None:
        levels.append(("backstop", hammer.position - smooth))
    if hammer.front is not None:
        levels.append(("pack", smooth - hammer.front))
    touches = [touch for surface, depth in levels for touch in _visits(surface, depth, clear)]
    if hammer.front is not None and not any(touch.surface == "pack" for touch in touches):
        depth = smooth - hammer.front
        touches += _visits("pack", depth, max(noisy, 0.5 * float(depth.max())))
    return sorted(touches, key=lambda touch: touch.first), smooth, clear


def _visits(surface: Surface, depth: FloatArray, clear: float) -> list[Touch]:
    """Find the contacts with a surface: runs of consecutive samples beyond the surface.

    `depth` [m] is the depth of each sample beyond the surface, negative in front of the surface. Only a run
    that is somewhere deeper than `clear` [m] counts as a contact, and a retreat from the surface by at most
    `clear` does not end a contact.
    """
    touches: list[Touch] = []
    inside, outside = np.flatnonzero(depth > clear), np.flatnonzero(depth < -clear)
    row = 0
    while True:
        after = inside[np.searchsorted(inside, row) :]
        if len(after) == 0:
            return touches
        first = int(after[0])
        while first > 0 and depth[first - 1] > 0.0:
            first -= 1
        away = outside[np.searchsorted(outside, after[0]) :]
        if len(away) == 0:
            return [*touches, Touch(surface, first, len(depth) - 1)]
        row = last = int(away[0])
        while depth[last] <= 0.0:
            last -= 1
        touches.append(Touch(surface, first, last))


def _check(
    name: str, t: FloatArray, smooth: FloatArray, clear: float, touches: list[Touch], hammer: Hammer
) -> None:
    """Raise `InputError` for a record that does not cover the shot from rest to after the impact.

    `smooth` is the smoothed record, m, and `clear` the threshold of the contact detection, m.
    """
    start = smooth[0] - hammer.position if hammer.position is not None else 0.0
    if start > clear:
        raise InputError(
            (f"{name}: the record begins at {_us(t[0])} with the armature {_um(start)} off the backstop"),
            file=name,
            key="start",
            expected="a record that begins at rest, before the firing",
        )
    if hammer.front is None:
        return
    packs = [touch for touch in touches if touch.surface == "pack"]
    if not packs:
        raise InputError(
            f"{name}: the record misses the impact: its largest displacement is {_um(float(smooth.max()))}",
            file=name,
            key="displacement",
            expected=(
                f"a record that goes beyond the front of the pack at {_um(hammer.front)} by more than noise"
            ),
        )
    if packs[0].last == len(t) - 1:
        raise InputError(
            f"{name}: the record ends at {_us(t[-1])} inside the pack",
            file=name,
            key="end",
            expected="a record of the whole impact",
        )
    if packs[0].count < FEWEST:
        spacing = float(np.median(np.diff(t)))
        raise InputError(
            f"{name}: {packs[0].count} samples in the pack, one every {_us(spacing)}",
            file=name,
            key="pack",
            expected=f"at least {FEWEST} in a contact",
        )


def _state(t: FloatArray, x: FloatArray, row: int, reach: int, noise: float) -> tuple[float, float]:
    """Estimate displacement [m] and velocity [m/s] at the sample `row` from a robust local parabola fit.

    The parabola is fitted to `reach` samples on either side; `noise` is the noise of the samples, m.
    """
    rows = slice(max(row - reach, 0), row + reach + 1)
    s = t[rows] - t[row]
    scale = float(np.abs(s).max())
    powers = np.stack([np.ones(len(s)), s / scale, (s / scale) ** 2], axis=1)
    weights = np.ones(len(s))
    for _ in range(4):
        inverse = np.linalg.pinv(powers.T @ (powers * weights[:, np.newaxis]))
        parabola = inverse @ (powers.T @ (weights * x[rows]))
        left = np.abs(x[rows] - powers @ parabola)
        weights = 1.0 / np.maximum(1.0, left / max(3.0 * float(np.median(left)), noise, 1e-15))
    return float(parabola[0]), float(parabola[1] / scale)


def stroke_of(hammer: Hammer, x: FloatArray) -> float:
    """Return the distance from backstop to pack, m; if either is missing, the range of the record."""
    if hammer.position is not None and hammer.front is not None:
        return hammer.front - hammer.position
    return float(np.ptp(x)) or 1e-4


def _smoothed(x: FloatArray, width: int) -> FloatArray:
    if width < 3:
        return x
    half = width // 2
    padded = np.concatenate([np.full(half, x[:width].mean()), x, np.full(half, x[-width:].mean())])
    return np.convolve(padded, np.full(width, 1.0 / width), mode="valid")


def _us(seconds: float) -> str:
    return f"{from_si(seconds, 's', 'us'):.4g} us"


def _um(metres: float) -> str:
    return f"{from_si(metres, 'm', 'um'):.4g} um"


_FLOOR: Final = 1e-9
"""Noise, as a fraction of the amplitude, below which a record is treated as exact; arbitrary."""
_POOR: Final = 1e-3  # Arbitrary
"""RMS residual of the fitted waveform, as a fraction of the peak current, that is always accepted."""
_LARGER: Final = 1.2  # Arbitrary
"""Ratio of RMS residual to noise above which the waveform does not describe the recorded current."""
_INTERVALS: Final = 200
"""Largest number of segments in a waveform sampled from the record; arbitrary."""


class Pulse(Declared, eq=False):
    """Current pulse of one shot, with the uncertainty of its waveform constants."""

    waveform: Waveform = part("waveform at the estimated values")
    names: tuple[str, ...] = part(
        'uncertain constants; "scale" for the size of a waveform taken from the record'
    )
    values: FloatArray = part("estimated values of the uncertain constants, SI, shape (n,)")
    covariance: FloatArray = part("covariance of the uncertain constants, shape (n, n)")
    note: str = part("remark, or an empty string", default="")

    def changed(self, values: Sequence[float]) -> Waveform:
        """Return the waveform with its fitted constants set to `values`."""
        if self.names == ("scale",):
            return self.waveform.scaled(float(values[0]))
        new = dict(zip(self.names, (float(value) for value in values), strict=True))
        return type(self.waveform)(**{**self.waveform.model_dump(), **new})

    def at(self, values: Sequence[float]) -> Pulse:
        """Return the pulse with its fitted constants set to `values`, without uncertainty."""
        waveform = self.changed(values) if self.names else self.waveform
        return Pulse(waveform, (), np.zeros(0), np.zeros((0, 0)))


def fit_pulse(where: str, t: FloatArray, current: FloatArray, waveform: Waveform | None, tau: float) -> Pulse:
    """Fit waveform constants to a recorded current; if the fit is poor, use the record as the waveform.

    `t` contains ascending times [s], with the firing at 0, and `current` the readings [A], both (n,);
    `waveform` gives the initial guess, and `tau` is the time constant of the sensor, s. Error messages begin
    with `where`.
    """
    noise = noise_of_record(current)
    top = float(np.percentile(np.abs(current[t >= 0.0]), 98.0)) if (t >= 0.0).any() else 0.0
    if top <= max(5.0 * noise, 0.0):
        raise InputError(
            f"{where}: the column 'current' shows no pulse",
            file=where,
            key="current",
            expected="the current of the shot",
        )
    if waveform is None or isinstance(waveform, Sampled):
        return _sampled_pulse(t, current, noise, "the current is taken from the record")
    pulse, rms = _fit_waveform(t, current, waveform, tau, top)
    if rms > max(_POOR * top, _LARGER * noise):
        share = f"{100.0 * rms / top:.2g} %"
        note = (
            f"{where}: a {waveform.shape} does not describe the current (residuals of {share} of its height);"
            " the current is taken from the record"
        )
        return _sampled_pulse(t, current, noise, note)
    return pulse


def _fit_waveform(
    t: FloatArray, current: FloatArray, waveform: Waveform, tau: float, top: float
) -> tuple[Pulse, float]:
    """Fit the constants of a waveform to a recorded current; return the pulse and the RMS residual, A.

    `top` is the height of the recorded pulse, A; `tau` is the time constant of the sensor, s, as in
    `fit_pulse`.
    """
    from scipy.optimize import least_squares

    names = tuple(name for name in quantities(type(waveform)) if getattr(waveform, name))
    base = waveform.model_dump()
    # Logarithms keep the times positive during the fit.
    sign = 1.0 if current[np.argmax(np.abs(current))] > 0.0 else -1.0

    def made(logs: FloatArray) -> Waveform:
        values = dict(zip(names, np.exp(logs).tolist(), strict=True))
        values["amplitude"] *= sign
        return type(waveform)(**{**base, **values})

    def shown(logs: FloatArray) -> FloatArray:
        segments = made(logs).segments()
        return evaluate(segments, t) if tau == 0.0 else lowpass_waveform(segments, t, tau)

    starts = _starts(t, current, {name: abs(getattr(waveform, name)) for name in names}, top)
    used = np.ones(len(t), bool)

    def residuals(logs: FloatArray) -> FloatArray:
        return np.where(used, shown(logs) - current, 0.0) / top

    # The noise is unknown beforehand, so the soft loss begins at residuals of 1 % of the pulse.
    rough = (least_squares(residuals, start, loss="soft_l1", f_scale=0.01) for start in starts)
    best: Any = min(rough, key=lambda solution: solution.cost)
    used = ~outliers_of(shown(best.x) - current, _FLOOR * top)
    best = least_squares(residuals, best.x, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    left = (shown(best.x) - current)[used]
    freedom = max(int(used.sum()) - len(names), 1)
    rms = float(np.sqrt(left @ left / freedom))
    values = np.exp(best.x)
    values[names.index("amplitude")] *= sign
    scaled = np.linalg.pinv(best.jac.T @ best.jac) * (max(rms, _FLOOR * top) / top) ** 2
    return Pulse(made(best.x), names, values, scaled * np.outer(values, values)), rms


def _starts(t: FloatArray, current: FloatArray, values: dict[str, float], top: float) -> list[FloatArray]:
    """Return the logarithms of two initial guesses of the waveform constants.

    The first guess is `values`, the second also `values`, but with amplitude and width from the record.
    """
    high = t[np.abs(current) > 0.5 * top]
    recorded = dict(values)
    recorded["amplitude"] = top
    recorded["width"] = max(float(high[-1] - high[0]), 1e-9) if len(high) else values["width"]
    return [np.log(np.array(list(constants.values()))) for constants in (values, recorded)]


def _sampled_pulse(t: FloatArray, current: FloatArray, noise: float, note: str) -> Pulse:
    """Build a waveform from the recorded current, averaged over short bins."""
    after = np.flatnonzero(t >= 0.0)
    each = max(1, -(-len(after) // _INTERVALS))
    bins = [after[i : i + each] for i in range(0, len(after), each)]
    times = np.array([t[rows].mean() for rows in bins])
    values = np.array([current[rows].mean() for rows in bins])
    scale = robust_scale(current) or 1.0
    waveform = Sampled.from_samples(times, values, interpolation="linear")
    # Standard error of the current's time integral, which drives the armature, due to noise.
    error = noise / scale / np.sqrt(len(after))
    return Pulse(waveform, ("scale",), np.ones(1), np.array([[max(error, _FLOOR) ** 2]]), note)
