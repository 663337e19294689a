"""Records of single shots with sensor errors, and fits of static measurements, for tests."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

import printhammer as ph
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.identify.result import Fit, FittedConstant

FINE = 0.1e-6


def write(
    path: Path,
    hammer: ph.Hammer,
    *,
    waveform: Waveform | None = None,
    noise: float = 0.2e-6,
    resolution: float = 0.05e-6,
    bandwidth: float | None = 200e3,
    spacing: float = 1e-6,
    begin: float = -100e-6,
    end: float = 1.6e-3,
    outliers: float = 0.0,
    current_noise: float | None = None,
    offset: float = 0.0,
    seed: int = 0,
    said: bool = True,
) -> Path:
    """Write the record of a shot: low-pass filter on a fine grid, noise, outliers, resolution."""
    rng = np.random.default_rng(seed)
    waveform = waveform or hammer.waveform
    assert waveform is not None
    fine = np.arange(0.0, end, FINE)
    motion = ph.simulate(hammer, ph.PulseTrain(waveform), times=fine, duration=end)
    assert motion.ok
    t = np.arange(begin, end - spacing, spacing)
    x = np.interp(t, fine, sensed(motion.x, motion.x[0], bandwidth))
    x = x + offset + noise * rng.standard_normal(len(t))
    bad = rng.random(len(t)) < outliers
    x = np.where(bad, x + rng.uniform(-50e-6, 50e-6, len(t)), x)
    if resolution:
        x = np.round(x / resolution) * resolution
    columns, names = [t * 1e6, x * 1e6], ["time [us]", "displacement [um]"]
    if current_noise is not None:
        current = np.interp(t, fine, sensed(motion.current, 0.0, bandwidth), left=0.0)
        columns.append(current + current_noise * rng.standard_normal(len(t)))
        names.append("current [A]")
    lines = [f"# bandwidth: {bandwidth!r} Hz"] if bandwidth and said else []
    rows = zip(*(column.tolist() for column in columns), strict=True)
    lines += [",".join(names), *(",".join(repr(cell) for cell in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def sensed(values: np.ndarray, before: float, bandwidth: float | None) -> np.ndarray:
    """Apply a first-order low-pass to straight lines between fine samples."""
    if bandwidth is None:
        return values
    from scipy.signal import lfilter

    tau = 1.0 / (2.0 * np.pi * bandwidth)
    kept = np.exp(-FINE / tau)
    share = tau / FINE * (1.0 - kept)
    return before + lfilter([1.0 - share, share - kept], [1.0, -kept], values - before)


def static_fit(hammer: ph.Hammer, errors: Mapping[str, float], seed: int) -> Fit:
    """A fit of constants with independent relative errors, and values drawn from its distribution."""
    rng = np.random.default_rng(seed)
    keys = tuple(errors)
    truth = np.array([hammer.constants[key].si for key in keys])
    sizes = np.abs(truth) * np.array(list(errors.values()))
    values = truth + sizes * rng.standard_normal(len(keys))
    constants = {
        key: FittedConstant.of(key, value, size, np.inf, hammer.constants[key].si_unit)
        for key, value, size in zip(keys, values, sizes, strict=True)
    }
    none = np.zeros(0)
    return Fit(
        kind="magnet",
        source=("static.csv",),
        constants=constants,
        keys=keys,
        covariance=np.diag(sizes**2),
        abscissa=none,
        data=none,
        fitted=none,
        residuals=none,
        axes=(("displacement", "m"), ("force", "N")),
        degrees_of_freedom=1e6,
        residual_scale=0.0,
        weights=none,
        outliers=np.zeros(0, bool),
        condition_number=1.0,
        series=np.zeros(0, np.int64),
        series_names=(),
        lines=np.zeros(0, np.int64),
    )
