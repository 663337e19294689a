"""The fit of single shots against known answers: exact records, and coverage of the intervals."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from tests.hammers import CRUDE
from tests.identify import shots

import printhammer as ph
from printhammer.drive.segments import evaluate
from printhammer.identify.lowpass import lowpass_motion, lowpass_waveform
from printhammer.identify.noise import memory_factor, noise_of_record
from printhammer.identify.shots.motion import fit_motion

HAMMER = ph.load(CRUDE)


def truth(key: str) -> float:
    """Constant of the hammer from which the records are generated, SI."""
    return HAMMER.constants[key].si


def test_exact_records_give_the_constants_back(tmp_path: Path) -> None:
    """Without noise, quantisation and delay, from an initial guess 30 % off."""
    path = shots.write(tmp_path / "shot.csv", HAMMER, noise=0.0, resolution=0.0, bandwidth=None)
    keys = ["mass", "backstop.damping", "backstop.stiffness", "pack.stiffness"]
    start = HAMMER.replace({key: 1.3 * truth(key) for key in keys[:2]})
    fit = fit_motion([path], start, free=keys)
    for key in keys:
        # A multiple of 0.1 us on the fine grid of the record is a sample up to rounding.
        assert fit[key].value == pytest.approx(truth(key), rel=1e-8)
    assert not fit.outliers.any()


@pytest.mark.slow
def test_damping_in_flight_is_found_too(tmp_path: Path) -> None:
    damped = HAMMER.replace("damping", {"law": "viscous", "coefficient": "0.15 N s/m"})
    path = shots.write(tmp_path / "shot.csv", damped, noise=0.0, resolution=0.0, bandwidth=None)
    keys = ["mass", "damping.coefficient", "backstop.damping"]
    start = damped.replace({key: 1.3 * damped.constants[key].si for key in keys})
    fit = fit_motion([path], start, free=keys)
    for key in keys:
        assert fit[key].value == pytest.approx(damped.constants[key].si, rel=1e-7)
    assert fit.into(start).damping == fit.into(damped).damping


def test_mass_and_forces_scale_together(tmp_path: Path) -> None:
    """Doubling the known forces doubles the fitted mass: equations (1) and (2) are linear in both."""
    path = shots.write(tmp_path / "shot.csv", HAMMER, seed=1)
    twice = {
        key: 2.0 * truth(key) for key in ("magnet.F0", "spring.Bs", "pack.stiffness", "backstop.stiffness")
    }
    twice |= {key: np.sqrt(2.0) * truth(key) for key in ("magnet.Am", "magnet.Bm")}
    one, other = fit_motion([path], HAMMER), fit_motion([path], HAMMER.replace(twice))
    for key in ("mass", "backstop.damping"):
        assert other[key].value == pytest.approx(2.0 * one[key].value, rel=1e-6)
        assert other[key].standard_error == pytest.approx(2.0 * one[key].standard_error, rel=1e-4)


def covered(folder: Path, seeds: range) -> dict[str, int]:
    """Count how often the 95 % intervals of several laboratories contain the constants."""
    count: dict[str, int] = {}
    for seed in seeds:
        path = shots.write(folder / "shot.csv", HAMMER, seed=seed, end=1.2e-3, current_noise=None)
        fit = fit_motion([path], HAMMER.replace("mass", 1.1 * HAMMER.mass), earlier=[])
        for key, constant in fit.constants.items():
            low, high = constant.interval
            count[key] = count.get(key, 0) + (low <= truth(key) <= high)
    return count


def test_intervals_cover_the_truth_in_a_few_laboratories(tmp_path: Path) -> None:
    """No constant is outside its interval more often than correct intervals allow once in 10 000 tests."""
    seeds = range(8)
    least = stats.binom.ppf(1e-4, len(seeds), 0.95)
    for key, count in covered(tmp_path, seeds).items():
        assert count >= least, key


@pytest.mark.slow
def test_intervals_cover_the_truth_in_89_to_99_of_100(tmp_path: Path) -> None:
    """The static constants are known exactly here; test_recovery.py uses constants with errors."""
    for key, count in covered(tmp_path, range(100)).items():
        assert 89 <= count <= 99, key


def test_low_pass_of_a_motion() -> None:
    """For t^3 after rest, the exact response is t^3 - 3 tau t^2 + 6 tau^2 t - 6 tau^3 (1 - exp(-t / tau))."""
    tau = 0.7
    t = np.array([0.0, 0.1, 0.5, 0.6, 1.7, 3.0])
    found = lowpass_motion(t, (t**3)[:, np.newaxis], (3.0 * t**2)[:, np.newaxis], tau)[:, 0]
    exact = t**3 - 3.0 * tau * t**2 + 6.0 * tau**2 * t - 6.0 * tau**3 * (1.0 - np.exp(-t / tau))
    assert np.abs(found - exact).max() < 1e-13


@pytest.mark.parametrize("shape", ["rectangle", "half-sine", "trapezoid", "sampled"])
def test_low_pass_of_a_waveform(shape: str) -> None:
    """The result equals the convolution with exp(-t / tau) / tau, by quadrature between the edges."""
    from scipy.integrate import quad
    from tests.hammers import waveforms

    tau = 20e-6
    segments = waveforms(1.0, "current")[shape].segments()
    times = np.linspace(5e-6, 600e-6, 13)
    found = lowpass_waveform(segments, times, tau)
    for t, shown in zip(times, found, strict=True):
        edges = [0.0, *segments[(segments[:, 0] > 0.0) & (segments[:, 0] < t), 0].tolist(), t]
        exact = sum(
            quad(
                lambda s, t=t: float(evaluate(segments, s)) * np.exp(-(t - s) / tau) / tau,
                low,
                high,
                epsabs=1e-13,
                epsrel=1e-12,
                limit=200,
            )[0]
            for low, high in pairwise(edges)
        )
        assert shown == pytest.approx(exact, abs=1e-10)


def test_noise_and_its_memory() -> None:
    """The factor is 1 for white noise, and (1 + a) / (1 - a) for x_t = a x_{t-1} + e_t."""
    noise = np.random.default_rng(8).normal(0.0, 0.3, 40_000)
    assert noise_of_record(noise + np.linspace(0.0, 1.0, len(noise))) == pytest.approx(0.3, rel=0.02)
    assert memory_factor(noise) == pytest.approx(1.0, abs=0.05)
    remembered = np.zeros(len(noise))
    for k in range(1, len(noise)):
        remembered[k] = 0.5 * remembered[k - 1] + noise[k]
    assert memory_factor(remembered) == pytest.approx(3.0, rel=0.1)
