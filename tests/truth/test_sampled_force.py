"""Forces sampled against displacement: motions piece by piece, energies, tangent maps, sensitivities."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq
from tests.tangents import deviation

import printhammer as ph

MASS = 2e-3


def sampled(
    folder: Path, x: np.ndarray, force: np.ndarray, interpolation: str = "pchip", name: str = "curve"
) -> dict[str, str]:
    """Entry of the list of forces with samples in a table, which this function writes."""
    path = folder / f"{name}.csv"
    rows = (f"{place!r},{value!r}\n" for place, value in zip(x.tolist(), force.tolist(), strict=True))
    path.write_text("displacement [m],force [N]\n" + "".join(rows), encoding="utf-8")
    return {"law": "sampled", "file": str(path), "interpolation": interpolation}


def random_curve(rng: np.random.Generator, count: int, slope: float) -> tuple[np.ndarray, np.ndarray]:
    """Samples from -3 to 3 mm, scattered about a spring; the forces at the ends reverse the motion."""
    x = np.sort(np.concatenate([[-3e-3, 3e-3], rng.uniform(-2.9e-3, 2.9e-3, count - 2)]))
    force = -slope * x + 0.3 * slope * 3e-3 * rng.uniform(-1.0, 1.0, count)
    force[[0, -1]] = 1.5 * slope * 3e-3, -1.5 * slope * 3e-3
    return x, force


def potential(x: np.ndarray, force: np.ndarray, interpolation: str, at: np.ndarray) -> np.ndarray:
    """Return the potential energy at displacements [J], from the first sample, by SciPy's interpolants."""
    if interpolation == "pchip":
        curve = PchipInterpolator(x, force)
        return -np.array([float(curve.integrate(x[0], place)) for place in at])
    whole = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(x) * (force[1:] + force[:-1]))])
    before = np.searchsorted(x, at, side="right") - 1
    return -(whole[before] + 0.5 * (at - x[before]) * (force[before] + np.interp(at, x, force)))


class Cell:
    """Closed form of the motion of a mass from a state inside a cell of a piecewise linear force."""

    def __init__(self, pull: float, slope: float, place: float, speed: float) -> None:
        self.pull, self.slope, self.place, self.speed = pull, slope, place, speed
        self.rate = math.sqrt(abs(slope))

    def at(self, s: float) -> tuple[float, float]:
        """Displacement and velocity after the time `s`: harmonic or hyperbolic about the equilibrium."""
        arc = self.rate * s
        c, w = (math.cos(arc), math.sin(arc)) if self.slope < 0.0 else (math.cosh(arc), math.sinh(arc))
        moved = self.speed * w / self.rate + self.pull * (c - 1.0) / self.slope
        return self.place + moved, self.speed * c + self.pull * w / self.rate

    def end(self, low: float, high: float, longest: float) -> float:
        """Time at which the motion leaves the cell from `low` to `high`; infinity if later than `longest`."""
        step = 0.02 / self.rate
        for k in range(math.ceil(longest / step) + 1):
            x = self.at((k + 1) * step)[0]
            if not low <= x <= high:
                wall = high if x > high else low
                start = (k + 1e-9) * step
                return float(
                    brentq(lambda s, wall=wall: self.at(s)[0] - wall, start, start + step, xtol=1e-18)
                )
        return math.inf


def pieces(x: np.ndarray, force: np.ndarray, state: tuple[float, float], times: np.ndarray) -> np.ndarray:
    """Return the displacements of a mass under a piecewise linear force, computed cell by cell."""
    result = np.empty(times.size)
    done, t = 0, 0.0
    place, speed = state
    k = int(np.searchsorted(x, place, side="right")) - 1
    while done < times.size:
        slope = (force[k + 1] - force[k]) / (x[k + 1] - x[k]) / MASS
        cell = Cell(force[k] / MASS + slope * (place - x[k]), slope, place, speed)
        last = t + cell.end(x[k], x[k + 1], times[-1] - t)
        while done < times.size and times[done] <= last:
            result[done] = cell.at(times[done] - t)[0]
            done += 1
        if done < times.size:
            place, speed = cell.at(last - t)
            up = abs(place - x[k + 1]) < abs(place - x[k])
            place = float(x[k + 1] if up else x[k])
            k += 1 if up else -1
            t = last
    return result


def free(hammer: ph.Hammer, state: tuple[float, float], times: np.ndarray, tolerance: float) -> ph.Motion:
    drive = ph.SineForce(1e-30, 1.0)
    return ph.simulate(hammer, drive, duration=times[-1], state=state, times=times, tolerance=tolerance)


@pytest.mark.parametrize("seed", range(6))
def test_straight_lines_agree_with_closed_forms_piece_by_piece(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, force = random_curve(rng, int(rng.integers(3, 12)), 50.0)
    hammer = ph.Hammer.build(MASS).replace("force.curve", sampled(tmp_path, x, force, "linear"))
    times = np.linspace(0.0, 0.08, 161)
    state = (float(rng.uniform(-1e-3, 1e-3)), float(rng.uniform(-0.1, 0.1)))
    motion = free(hammer, state, times, 1e-13)
    assert motion.ok
    assert np.abs(motion.x - pieces(x, force, state, times)).max() < 1e-11 * 3e-3


@pytest.mark.parametrize("interpolation", ["pchip", "linear"])
@pytest.mark.parametrize("count", [2, 3, 17, 100])
def test_energy_is_conserved_along_the_curve_of_scipy(tmp_path: Path, interpolation: str, count: int) -> None:
    rng = np.random.default_rng(count)
    x, force = random_curve(rng, count, 50.0)
    hammer = ph.Hammer.build(MASS).replace("force.curve", sampled(tmp_path, x, force, interpolation))
    times = np.linspace(0.0, 0.1, 301)
    motion = free(hammer, (1.2e-3, 0.0), times, 1e-12)
    assert motion.ok
    _, v = motion.at(times)
    kind = interpolation if count > 2 else "linear"
    energy = 0.5 * MASS * v**2 + potential(x, force, kind, motion.x)
    assert np.abs(energy - energy[0]).max() < 1e-11 * 50.0 * 3e-3**2
    assert abs(motion.energy.residual) < 1e-11 * 50.0 * 3e-3**2
    assert np.ptp(motion.x) > 1e-3


def test_a_curve_with_kinks_equals_a_spring_with_contacts(tmp_path: Path) -> None:
    """The contact spring of a relay, as a measured table and as a list: the same dots."""
    parts = {
        "backstop": {"law": "rigid", "position": 0.0, "restitution": 0.3},
        "pack": {"law": "dashpot", "front": 0.5e-3, "stiffness": 1e6, "damping": 10.0},
        "waveform": {"shape": "half-sine", "amplitude": "3 N", "width": 1.5e-3},
        "force.weight": {"law": "gravity", "angle": "60 deg"},
    }
    listed = ph.Hammer.build(MASS).replace(
        {
            **parts,
            "spring": {"law": "preload", "preload": -0.5, "stiffness": 100.0},
            "contact.front": {"law": "linear", "side": "front", "position": 0.3e-3, "stiffness": 3e3},
        }
    )
    x = np.array([-1e-4, 0.3e-3, 0.7e-3])
    force = -0.5 - 100.0 * x - 3e3 * np.maximum(x - 0.3e-3, 0.0)
    measured = ph.Hammer.build(MASS).replace(
        {**parts, "force.springs": sampled(tmp_path, x, force, "linear")}
    )
    assert measured.rest == listed.rest == 0.0
    runs = [
        ph.simulate(hammer, ph.PulseTrain(hammer.waveform, period=4e-3, pulses=4), tolerance=1e-13)
        for hammer in (listed, measured)
    ]
    columns = [
        np.array([[dot.flight_time, dot.impact_speed, dot.peak_force] for dot in run.dots]) for run in runs
    ]
    assert len(columns[0]) == 4
    assert np.abs(columns[1] / columns[0] - 1.0).max() < 1e-11


@pytest.mark.parametrize("interpolation", ["pchip", "linear"])
def test_tangent_maps_through_samples(tmp_path: Path, interpolation: str) -> None:
    rng = np.random.default_rng(7)
    x, force = random_curve(rng, 15, 50.0)
    hammer = ph.Hammer.build(MASS).replace(
        {
            "force.curve": sampled(tmp_path, x, force, interpolation),
            "backstop": {"law": "rigid", "position": -1.5e-3, "restitution": 0.7},
            "damping": {"law": "viscous", "coefficient": 0.02},
        }
    )
    drive = ph.SineForce(0.05, 40.0)
    for _ in range(5):
        state = (float(rng.uniform(-1e-3, 1e-3)), float(rng.uniform(-0.1, 0.1)))
        assert deviation(hammer, drive, 0.0, 0.05, state=state, size=1e-5) < 1e-6


def test_sensitivities_under_a_sampled_force(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    x = np.linspace(-0.2e-3, 0.8e-3, 21)
    force = -0.5 - 300.0 * x + 0.02 * rng.uniform(-1.0, 1.0, x.size)
    hammer = ph.Hammer.build(MASS).replace(
        {
            "force.curve": sampled(tmp_path, x, force),
            "backstop": {"law": "rigid", "position": 0.0, "restitution": 0.3},
            "pack": {"law": "dashpot", "front": 0.5e-3, "stiffness": 1e6, "damping": 10.0},
            "waveform": {"shape": "half-sine", "amplitude": "3 N", "width": 1.5e-3},
        }
    )

    def dots_of(one: ph.Hammer) -> np.ndarray:
        drive = ph.PulseTrain(one.waveform, period=4e-3, pulses=2)
        dots = ph.simulate(one, drive, tolerance=1e-14).dots
        return np.array([[dot.flight_time, dot.impact_speed, dot.peak_force] for dot in dots])

    drive = ph.PulseTrain(hammer.waveform, period=4e-3, pulses=2)
    keys = ("mass", "backstop.restitution", "waveform.amplitude", "pack.front")
    result = ph.sensitivities(hammer, drive, tolerance=1e-13, constants=keys)
    rows = [result.quantities.index(name) for name in ("flight_time", "impact_speed", "peak_force")]
    for key in keys:
        value = hammer.constants[key].si
        step = 1e-4 * value
        weights = ((1, 8.0), (-1, -8.0), (2, -1.0), (-2, 1.0))
        moved = (weight * dots_of(hammer.replace(key, value + k * step)) for k, weight in weights)
        own = result.derivatives[:, rows, result.constants.index(key)]
        scale = np.abs(result.dots[:, rows]) / value
        assert np.abs((own - sum(moved) / (12.0 * step)) / scale).max() < 3e-7, key


@pytest.mark.parametrize("interpolation", ["pchip", "linear"])
def test_a_run_beyond_the_samples_ends_with_a_status(tmp_path: Path, interpolation: str) -> None:
    x = np.linspace(-1e-3, 1e-3, 9)
    hammer = ph.Hammer.build(MASS).replace("force.curve", sampled(tmp_path, x, -50.0 * x, interpolation))
    motion = ph.simulate(hammer, ph.SineForce(1e-30, 1.0), duration=0.05, state=(0.5e-3, 0.5))
    assert motion.status == "range left"
    assert motion.x[-1] == pytest.approx(1e-3, abs=1e-9)


def test_a_strongly_bent_curve_has_the_period_of_its_energy_integral(tmp_path: Path) -> None:
    """A cell between two flat ends: the period follows from the quadrature of 1/v, without an integrator."""
    from scipy.integrate import quad

    x = np.array([-2e-3, -1e-3, 1e-3, 2e-3])
    force = np.array([0.4, 0.1, -0.1, -0.4])
    hammer = ph.Hammer.build(MASS).replace("force.curve", sampled(tmp_path, x, force))
    far = 1.7e-3
    curve = PchipInterpolator(x, force)
    depth = curve.integrate(0.0, far)

    def slowness(angle: float) -> float:
        place = far * math.sin(angle)
        work = curve.integrate(place, far)
        return (
            far * math.cos(angle) / math.sqrt(-2.0 * work / MASS)
            if work < 0.0
            else math.sqrt(far * MASS / -float(curve(far)))
        )

    assert depth < 0.0
    quarter = quad(slowness, 0.0, 0.5 * math.pi, epsabs=1e-15, epsrel=1e-12, points=[math.asin(1e-3 / far)])[
        0
    ]
    motion = free(hammer, (far, 0.0), np.array([0.0, 4.0 * quarter]), 1e-13)
    assert motion.x[-1] == pytest.approx(far, abs=1e-11 * far)
    _, v = motion.at(np.array([4.0 * quarter]))
    assert abs(float(v[0])) < 1e-9 * math.sqrt(-2.0 * depth / MASS)
