"""The current of a recorded shot: the waveform of the hammer fitted to it, or the record itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.drive.segments import evaluate
from printhammer.drive.waveforms.shapes import Sampled, Waveform
from printhammer.errors import InputError
from printhammer.identify.lowpass import lowpass_waveform
from printhammer.identify.residuals import noise_of_record, outliers_of, robust_scale
from printhammer.results import Declared, part
from printhammer.support.constants import quantities

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.support.arrays import FloatArray

_FLOOR: Final = 1e-9
"""Noise, in units of the amplitude, below which a record counts as exact."""
_POOR: Final = 1e-3
"""Residuals, in units of the amplitude, that do not matter."""
_LARGER: Final = 1.2
"""Residuals, in units of the noise, with which a shape does not describe a current."""
_INTERVALS: Final = 200
"""Most pieces of a waveform that is taken from the record."""


class Pulse(Declared, eq=False):
    """The waveform of one shot, and how well it is known."""

    waveform: Waveform = part("at the values found")
    names: tuple[str, ...] = part(
        'constants that are uncertain; "scale" for the size of a waveform taken from the record'
    )
    values: FloatArray = part("their values, SI, shape (n,)")
    covariance: FloatArray = part("of these, shape (n, n)")
    note: str = part("what is odd; may be empty", default="")

    def changed(self, values: Sequence[float]) -> Waveform:
        """Return the waveform with other values of its constants."""
        if self.names == ("scale",):
            return self.waveform.scaled(float(values[0]))
        new = dict(zip(self.names, (float(value) for value in values), strict=True))
        return type(self.waveform)(**{**self.waveform.model_dump(), **new})

    def at(self, values: Sequence[float]) -> Pulse:
        """Return the waveform at other values of its constants, as one that is known exactly."""
        waveform = self.changed(values) if self.names else self.waveform
        return Pulse(waveform, (), np.zeros(0), np.zeros((0, 0)))


def fit_pulse(where: str, t: FloatArray, current: FloatArray, waveform: Waveform | None, tau: float) -> Pulse:
    """Fit the constants of a waveform to a recorded current, or take the record as the waveform.

    The record has times, s, ascending, of which the firing is 0, and currents, A, both of shape (n,); the
    waveform has constants near which to look, and `tau` is the time constant of the sensor, s. Messages begin
    with `where`.

    Raises
    ------
    InputError
        The record shows no current.
    """
    noise = noise_of_record(current)
    top = float(np.percentile(np.abs(current[t >= 0.0]), 98.0)) if (t >= 0.0).any() else 0.0
    if top <= max(5.0 * noise, 0.0):
        raise InputError(f"{where}: the column 'current' shows no pulse, expected the current of the shot")
    if waveform is None or isinstance(waveform, Sampled):
        return _recorded(t, current, noise, "the current is taken from the record")
    pulse, rms = _fitted(t, current, waveform, tau, top)
    if rms > max(_POOR * top, _LARGER * noise):
        share = f"{100.0 * rms / top:.2g} %"
        note = (
            f"{where}: a {waveform.shape} does not describe the current (residuals of {share} of its height);"
            " the current is taken from the record"
        )
        return _recorded(t, current, noise, note)
    return pulse


def _fitted(
    t: FloatArray, current: FloatArray, waveform: Waveform, tau: float, top: float
) -> tuple[Pulse, float]:
    """Return the pulse, and the size of the residuals, A."""
    from scipy.optimize import least_squares

    names = tuple(name for name in quantities(type(waveform)) if getattr(waveform, name))
    base = waveform.model_dump()
    # A logarithm keeps times positive, whatever the fit tries.
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

    # As the noise is not known before, the soft loss begins where residuals are a hundredth of the pulse.
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
    """Return where to begin: at the constants given, and with height and width as they look in the record."""
    high = t[np.abs(current) > 0.5 * top]
    recorded = dict(values)
    recorded["amplitude"] = top
    recorded["width"] = max(float(high[-1] - high[0]), 1e-9) if len(high) else values["width"]
    return [np.log(np.array(list(constants.values()))) for constants in (values, recorded)]


def _recorded(t: FloatArray, current: FloatArray, noise: float, note: str) -> Pulse:
    """Return the record itself, averaged over short bins, as a waveform."""
    after = np.flatnonzero(t >= 0.0)
    each = max(1, -(-len(after) // _INTERVALS))
    bins = [after[i : i + each] for i in range(0, len(after), each)]
    times = np.array([t[rows].mean() for rows in bins])
    values = np.array([current[rows].mean() for rows in bins])
    scale = robust_scale(current) or 1.0
    waveform = Sampled.from_samples(times, values, interpolation="linear")
    # What noise does to the impulse of the current, which is what moves the armature.
    error = noise / scale / np.sqrt(len(after))
    return Pulse(waveform, ("scale",), np.ones(1), np.array([[max(error, _FLOOR) ** 2]]), note)
