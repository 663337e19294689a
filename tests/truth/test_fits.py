"""Fits recover constants: exactly from exact tables, and with the stated coverage from noisy tables."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests import measurements as lab
from tests.measurements import write

from printhammer.identify.result import Fit
from printhammer.identify.static.backstop import RATIO, Stiffness, fit_backstop, rebound
from printhammer.identify.static.magnet import fit_magnet
from printhammer.identify.static.pack import fit_pack
from printhammer.identify.static.spring import fit_spring

FIVE = {
    "magnet.F0": lab.F0,
    "magnet.Am": lab.AM,
    "magnet.Bm": lab.BM,
    "spring.Bs": lab.BS,
    "spring.As": lab.AS,
}
C, SLOPE = "magnet.F0 + spring.Bs (1 + b / spring.As)", "spring.Bs / spring.As"


def assert_found(fit: Fit, truth: dict[str, float]) -> None:
    assert {key: fit[key].value for key in truth} == pytest.approx(truth, rel=1e-8, abs=1e-14)
    assert all(fit[key].standard_error <= 1e-8 * abs(value) + 1e-14 for key, value in truth.items())
    assert not fit.rejected
    assert not fit.outliers.any()


def test_magnet_and_spring_from_exact_forces(tmp_path: Path) -> None:
    forces, alone = write(tmp_path / "m.csv", lab.magnet()), write(tmp_path / "s.csv", lab.spring())
    assert_found(fit_magnet(forces, position=lab.B, spring=alone), FIVE)
    both = fit_magnet(forces, position=lab.B, spring=alone, zero=None)
    assert_found(both, {**FIVE, "zero of the displacement": 0.0})


def test_forces_of_both_alone_give_combinations(tmp_path: Path) -> None:
    fit = fit_magnet(write(tmp_path / "m.csv", lab.magnet()), position=lab.B)
    truth = {
        C: lab.F0 + lab.BS * (1 + lab.B / lab.AS),
        "magnet.Am": lab.AM,
        "magnet.Bm": lab.BM,
        SLOPE: lab.BS / lab.AS,
    }
    assert_found(fit, truth)
    assert list(fit.constants) == list(truth)
    assert "cannot be separated" in fit.indistinct[0]
    assert set(fit.for_file) == {"magnet.Am", "magnet.Bm"}


def test_two_currents_suffice(tmp_path: Path) -> None:
    fit = fit_magnet(write(tmp_path / "m.csv", lab.magnet(currents=(0.0, 1.2))))
    assert_found(fit, {"magnet.Am": lab.AM, "magnet.Bm": lab.BM})
    assert any("two currents" in sentence for sentence in fit.indistinct)


def test_spring_from_exact_forces(tmp_path: Path) -> None:
    fit = fit_spring(write(tmp_path / "s.csv", lab.spring()), position=lab.B)
    assert_found(fit, {"spring.Bs": lab.BS, "spring.As": lab.AS})


@pytest.mark.parametrize("named", [True, False])
def test_pack_from_exact_cycles(tmp_path: Path, named: bool) -> None:
    columns, branch = lab.pack()
    table = write(tmp_path / "p.csv", columns, branch if named else None)
    assert_found(fit_pack(table, thickness=lab.THICKNESS), {"pack.stiffness": lab.STIFFNESS})
    truth = {
        "pack.stiffness": lab.STIFFNESS,
        "exponent of loading": 2.7,
        "exponent of unloading": 11.0,
    }
    assert_found(fit_pack(table, thickness=lab.THICKNESS, exponents=True), truth)


def test_backstop_from_exact_rebounds(tmp_path: Path) -> None:
    fit = fit_backstop(write(tmp_path / "r.csv", lab.rebounds()), stiffness=1.2e9)
    assert_found(fit, {RATIO: lab.RATIO, "backstop.damping": lab.RATIO * 1.2e9})


@pytest.mark.parametrize("z", [1e-12, 1e-6, 1e-3, 0.0199, 0.0201, 0.3, 2.0, 50.0])
def test_restitution_by_the_lambert_function(z: float) -> None:
    e, slope = rebound(np.array([z]))
    assert e[0] * z / lab.RATIO == pytest.approx(lab.rebound(z / lab.RATIO), rel=1e-12)
    nearby = [lab.rebound(factor * z / lab.RATIO) * lab.RATIO / (factor * z) for factor in (0.999, 1.001)]
    assert slope[0] == pytest.approx((nearby[1] - nearby[0]) / (0.002 * z), rel=1e-4, abs=1e-16 / z * 1e4)


def test_stiffness_of_two_bodies_and_its_error() -> None:
    """Against k = (4/3) E* sqrt(R), and its relative error by propagation of errors."""
    bodies = [(2e-3, 4e-5)], [(200e9, 0.0), (200e9, 0.0)], [(0.3, 0.0), (0.3, 0.0)]
    k = Stiffness.from_bodies(*bodies)
    modulus = 200e9 / (2 * (1 - 0.3**2))
    assert k.value == pytest.approx(4 / 3 * modulus * 2e-3**0.5, rel=1e-14)
    assert k.standard_error / k.value == pytest.approx(0.5 * 4e-5 / 2e-3, rel=1e-6)
    fit = fit_backstop(stiffness=k)
    assert fit["backstop.stiffness"].value == k.value


def noisy_magnet(folder: Path, rng: np.random.Generator) -> Fit:
    """Displacement, current and force all have errors."""
    tables = []
    for name, columns in (("m.csv", lab.magnet()), ("s.csv", lab.spring())):
        sizes = {"displacement": 2e-7, "current": 2e-3, "force": 0.1}
        found = {key: value + sizes[key] * rng.standard_normal(len(value)) for key, value in columns.items()}
        tables.append(write(folder / name, found))
    return fit_magnet(tables[0], position=lab.B, spring=tables[1])


def noisy_spring(folder: Path, rng: np.random.Generator) -> Fit:
    columns = lab.spring()
    columns["force"] = columns["force"] + 0.07 * rng.standard_normal(len(columns["force"]))
    return fit_spring(write(folder / "s.csv", columns), position=lab.B)


def noisy_pack(folder: Path, rng: np.random.Generator, *, exponents: bool = False) -> Fit:
    """An error of 0.2 um shifts the steep unloading branch more than the force error does."""
    columns, branch = lab.pack()
    columns["indentation"] = columns["indentation"] + 2e-7 * rng.standard_normal(len(branch))
    columns["force"] = columns["force"] + 0.2 * rng.standard_normal(len(branch))
    return fit_pack(write(folder / "p.csv", columns, branch), thickness=lab.THICKNESS, exponents=exponents)


def noisy_exponents(folder: Path, rng: np.random.Generator) -> Fit:
    return noisy_pack(folder, rng, exponents=True)


def noisy_backstop(folder: Path, rng: np.random.Generator) -> Fit:
    columns = lab.rebounds()
    found = {key: value * (1 + 0.01 * rng.standard_normal(len(value))) for key, value in columns.items()}
    return fit_backstop(write(folder / "r.csv", found))


LABORATORIES = {
    "magnet": (noisy_magnet, FIVE),
    "spring": (noisy_spring, {"spring.Bs": lab.BS, "spring.As": lab.AS}),
    "pack": (noisy_pack, {"pack.stiffness": lab.STIFFNESS}),
    "exponents": (
        noisy_exponents,
        {"pack.stiffness": lab.STIFFNESS, "exponent of loading": 2.7, "exponent of unloading": 11.0},
    ),
    "backstop": (noisy_backstop, {RATIO: lab.RATIO}),
}


def covered(
    folder: Path, make: Callable[..., Fit], truth: dict[str, float], seeds: int
) -> tuple[dict[str, int], int]:
    """Count the intervals that contain the truth, and the laws rejected."""
    counts, rejected = dict.fromkeys(truth, 0), 0
    for seed in range(seeds):
        fit = make(folder, np.random.default_rng(seed))
        rejected += bool(fit.rejected)
        for key, value in truth.items():
            low, high = fit[key].interval
            counts[key] += low <= value <= high
    return counts, rejected


@pytest.mark.parametrize("kind", LABORATORIES)
def test_intervals_contain_the_truth_in_a_few_laboratories(tmp_path: Path, kind: str) -> None:
    """At a coverage of 95 %, fewer than 7 of 10 would occur once in 1000 repetitions."""
    counts, rejected = covered(tmp_path, *LABORATORIES[kind], seeds=10)
    assert min(counts.values()) >= 7
    assert rejected <= 2


@pytest.mark.slow
@pytest.mark.parametrize("kind", LABORATORIES)
def test_intervals_contain_the_truth_as_often_as_they_say(tmp_path: Path, kind: str) -> None:
    """Of 400 intervals at 95 %, a count outside 362 to 394 occurs about once in 1000 repetitions."""
    counts, rejected = covered(tmp_path, *LABORATORIES[kind], seeds=400)
    assert all(362 <= count <= 394 for count in counts.values()), counts
    assert rejected <= 14


def test_a_constant_restitution_is_rejected(tmp_path: Path) -> None:
    columns = lab.rebounds()
    noise = 1 + 0.01 * np.random.default_rng(1).standard_normal(30)
    columns["rebound speed"] = 0.7 * columns["impact speed"] * noise
    fit = fit_backstop(write(tmp_path / "r.csv", columns))
    assert "constant restitution of 0.7" in fit.rejected
    assert fit.p_value < 1e-6


def test_other_exponents_of_the_pack_are_rejected(tmp_path: Path) -> None:
    columns, branch = lab.pack()
    loading = np.array(branch) == "loading"
    ratio = columns["indentation"] / lab.THICKNESS
    columns["force"] = np.where(loading, lab.STIFFNESS * ratio**2.2, columns["force"])
    columns["force"] = columns["force"] + 0.2 * np.random.default_rng(2).standard_normal(len(branch))
    fit = fit_pack(write(tmp_path / "p.csv", columns, branch), thickness=lab.THICKNESS)
    assert fit.p_value < 1e-6
    assert "describe it better than 2.7 and 11" in fit.rejected


def test_another_dependence_on_the_displacement_is_rejected(tmp_path: Path) -> None:
    columns = lab.magnet()
    x, current = columns["displacement"], columns["current"]
    pull = (lab.AM - lab.BM * current) ** 2 * x**-1.0 * 1e-2
    columns["force"] = 18.0 - 3e4 * x - pull + 0.1 * np.random.default_rng(3).standard_normal(len(x))
    fit = fit_magnet(write(tmp_path / "m.csv", columns))
    assert fit.rejected
    assert fit.p_value < 1e-3


def test_a_bent_spring_is_rejected(tmp_path: Path) -> None:
    columns = lab.spring()
    u = columns["displacement"] / 1e-4
    noise = 0.02 * np.random.default_rng(4).standard_normal(len(u))
    columns["force"] = columns["force"] + 0.1 * u * u + noise
    assert "linear" in fit_spring(write(tmp_path / "s.csv", columns), position=lab.B).rejected
