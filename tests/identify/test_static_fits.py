"""Outliers, insufficient data, invalid input, and results as fragments of hammer files."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from tests import measurements as lab
from tests.errors import refused
from tests.measurements import Array, write

import printhammer as ph
from printhammer.errors import InputError
from printhammer.identify.result import Fit
from printhammer.identify.static.backstop import RATIO, Stiffness, fit_backstop
from printhammer.identify.static.magnet import fit_magnet
from printhammer.identify.static.pack import fit_pack
from printhammer.identify.static.spring import fit_spring


def noisy(columns: dict[str, Array], name: str, size: float, seed: int = 0) -> dict[str, Array]:
    noise = size * np.random.default_rng(seed).standard_normal(len(columns[name]))
    return {**columns, name: columns[name] + noise}


def spoiled(columns: dict[str, Array], name: str, rows: list[int], by: float) -> dict[str, Array]:
    values = columns[name].copy()
    values[rows] += by
    return {**columns, name: values}


def magnet(folder: Path, columns: dict[str, Array] | None = None, **options: object) -> Fit:
    table = write(folder / "magnet.csv", columns or lab.magnet())
    return fit_magnet(table, **options)  # type: ignore[arg-type]


def fits_with_outliers(folder: Path) -> dict[str, tuple[Fit, Fit, list[int]]]:
    """Robust and ordinary fits, and the corrupted rows."""
    found = {}
    rows = [3, 17, 40]
    columns = spoiled(noisy(lab.magnet(), "force", 0.05), "force", rows, 3.0)
    pair = [magnet(folder, columns, robust=robust) for robust in (True, False)]
    found["magnet"] = (*pair, rows)
    columns = spoiled(noisy(lab.spring(40), "force", 0.05), "force", rows[:2], -2.0)
    table = write(folder / "spring.csv", columns)
    pair = [fit_spring(table, position=lab.B, robust=robust) for robust in (True, False)]
    found["spring"] = (*pair, rows[:2])
    columns, branch = lab.pack()
    columns = spoiled(noisy(columns, "force", 0.2), "force", [12, 70, 90], 12.0)
    table = write(folder / "pack.csv", columns, branch)
    pair = [fit_pack(table, thickness=lab.THICKNESS, robust=robust) for robust in (True, False)]
    found["pack"] = (*pair, [12, 70, 90])
    columns = spoiled(noisy(lab.rebounds(), "rebound speed", 0.005), "rebound speed", rows[:2], -0.2)
    table = write(folder / "rebounds.csv", columns)
    pair = [fit_backstop(table, robust=robust) for robust in (True, False)]
    found["backstop"] = (*pair, rows[:2])
    return found


def test_outliers_are_left_out_and_named(tmp_path: Path) -> None:
    truth = {
        "magnet.Am": lab.AM,
        "magnet.Bm": lab.BM,
        "spring.Bs": lab.BS,
        "spring.As": lab.AS,
        "pack.stiffness": lab.STIFFNESS,
        RATIO: lab.RATIO,
    }
    for kind, (robust, plain, rows) in fits_with_outliers(tmp_path).items():
        # The heading is line 1.
        assert set(robust.lines[robust.outliers]) >= {row + 2 for row in rows}, kind
        assert robust.outliers.sum() <= len(rows) + 1
        assert not plain.outliers.any()
        assert any("outliers left out: lines" in line for line in robust.report)
        for key, value in truth.items():
            if key in robust.constants:
                assert abs(robust[key].value - value) < 4 * robust[key].standard_error, key
                assert robust[key].standard_error < plain[key].standard_error


def test_the_same_table_gives_the_same_bits(tmp_path: Path) -> None:
    columns = noisy(lab.magnet(), "force", 0.1)
    first, second = (magnet(tmp_path, columns, position=lab.B) for _ in range(2))
    assert first.constants == second.constants
    np.testing.assert_array_equal(first.covariance, second.covariance)


def test_the_order_of_rows_does_not_matter(tmp_path: Path) -> None:
    columns = noisy(lab.magnet(), "force", 0.1)
    order = np.random.default_rng(1).permutation(len(columns["force"]))
    first = magnet(tmp_path, columns)
    second = magnet(tmp_path, {name: values[order] for name, values in columns.items()})
    for key, constant in first.constants.items():
        assert second[key].value == pytest.approx(constant.value, rel=1e-7)
        assert second[key].standard_error == pytest.approx(constant.standard_error, rel=1e-4)


def test_a_zero_of_the_sensor_is_found_or_given(tmp_path: Path) -> None:
    columns = lab.magnet()
    alone = lab.spring()
    for table in (columns, alone):
        table["displacement"] = table["displacement"] + 4e-6
    spring = write(tmp_path / "s.csv", alone)
    given = magnet(tmp_path, columns, spring=spring, position=lab.B, zero=4e-6)
    found = magnet(tmp_path, columns, spring=spring, position=lab.B, zero=None)
    for fit in (given, found):
        assert fit["magnet.F0"].value == pytest.approx(lab.F0, rel=1e-6)
        assert fit["spring.Bs"].value == pytest.approx(lab.BS, rel=1e-8)
    assert found["zero of the displacement"].value == pytest.approx(4e-6, rel=1e-6)


def test_a_weak_constant_has_a_profile(tmp_path: Path) -> None:
    alone = write(tmp_path / "s.csv", noisy(lab.spring(), "force", 0.5, seed=5))
    fit = magnet(tmp_path, noisy(lab.magnet(), "force", 0.5), spring=alone, position=lab.B)
    found = fit.profiles["magnet.F0"]
    constant = fit["magnet.F0"]
    assert found.interval == pytest.approx(constant.interval, abs=constant.standard_error)
    assert found.increase.min() == pytest.approx(0.0, abs=1e-6)
    assert np.all(np.diff(found.values) > 0.0)
    assert any("weakly determined" in note for note in fit.remarks)


def test_constants_that_go_together_are_named(tmp_path: Path) -> None:
    columns = {name: values[:35] for name, values in lab.magnet(places=40).items()}
    fit = magnet(tmp_path, noisy(columns, "force", 0.002))
    assert fit.condition_number > 30
    assert any("are correlated" in sentence and "magnet.Am" in sentence for sentence in fit.indistinct)


def test_a_stiffness_taken_as_known_is_no_result(tmp_path: Path) -> None:
    table = write(tmp_path / "r.csv", noisy(lab.rebounds(), "rebound speed", 0.01))
    known = fit_backstop(table, stiffness=1e9)
    assert known.keys == ("backstop.damping",)
    assert known.given == {"backstop.stiffness": "1000000000.0 N/m^1.5"}
    assert known["backstop.damping"].value == pytest.approx(1e9 * known[RATIO].value)
    bodies = Stiffness(1e9, 3e7, "computed from radii")
    both = fit_backstop(table, stiffness=bodies)
    assert both.keys == ("backstop.stiffness", "backstop.damping")
    # The error of k goes into l as well.
    relative = both["backstop.damping"].standard_error / both["backstop.damping"].value
    part = known["backstop.damping"].standard_error / known["backstop.damping"].value
    assert relative == pytest.approx(np.hypot(part, 0.03), rel=1e-9)
    assert both.covariance[0, 1] > 0.0


FITTED = ("magnet.F0", "magnet.Am", "magnet.Bm", "spring.Bs", "spring.As")


def test_into_a_hammer_and_back(tmp_path: Path, hammer: ph.Hammer) -> None:
    alone = write(tmp_path / "spring.csv", lab.spring())
    fit = magnet(tmp_path, noisy(lab.magnet(), "force", 0.1), spring=alone, position=hammer.position)
    made = fit.into(hammer)
    made.save(tmp_path / "made.toml")
    again = ph.load(tmp_path / "made.toml")
    for key in FITTED:
        constant = again.constants[key]
        assert constant.si == fit[key].value
        assert constant.status == "derived"
        assert constant.source.startswith("fitted to magnet.csv and spring.csv, standard error ")
    others = set(again.constants) - set(FITTED)
    assert all(again.constants[key] == hammer.constants[key] for key in others)
    table = tomllib.loads(fit.fragment())
    assert {key: table[key.split(".")[0]][key.split(".")[1]]["value"] for key in FITTED} == {
        key: fit[key].value for key in FITTED
    }
    assert table["magnet"]["law"] == "inverse-root"


def test_a_hammer_that_does_not_go_with_the_fit(tmp_path: Path, hammer: ph.Hammer) -> None:
    fit = fit_spring(write(tmp_path / "s.csv", lab.spring()), position=6e-5)
    with refused("backstop.position"):
        fit.into(hammer)
    other = hammer.replace({"spring": None})
    with refused("spring"):
        fit_spring(write(tmp_path / "s.csv", lab.spring()), position=lab.B).into(other)


def test_a_damping_takes_the_place_of_a_restitution(tmp_path: Path, hammer: ph.Hammer) -> None:
    given = {"law": "hertz", "position": "0.002 in", "stiffness": 1e9}
    rebound = {**given, "restitution": 0.8, "restitution_speed": 1.0}
    other = hammer.replace({"backstop": rebound})
    fit = fit_backstop(write(tmp_path / "r.csv", lab.rebounds()), stiffness=1e9)
    made = fit.into(other)
    assert "backstop.restitution" not in made.constants
    assert made.constants["backstop.damping"].si == fit["backstop.damping"].value


def spring_only(folder: Path, columns: dict[str, Array]) -> Fit:
    return fit_spring(write(folder / "magnet.csv", columns), position=lab.B)


def pack_only(folder: Path, columns: dict[str, Array], branch: list[str] | None = None) -> Fit:
    return fit_pack(write(folder / "magnet.csv", columns, branch), thickness=lab.THICKNESS)


def rows_of(columns: dict[str, Array], rows: slice) -> dict[str, Array]:
    return {name: values[rows] for name, values in columns.items()}


def holding() -> dict[str, Array]:
    columns = lab.magnet(currents=(0.0, 0.1, 0.2))
    return {**columns, "force": columns["force"] - 3.0}


def falling() -> tuple[dict[str, Array], list[str]]:
    columns, branch = lab.pack(peaks=(90e-6,))
    columns["force"][12:20] = np.linspace(columns["force"][12], 2.0, 8)
    return columns, branch


def turned_round() -> tuple[dict[str, Array], list[str]]:
    columns, _branch = lab.pack(peaks=(90e-6,))
    return rows_of(columns, slice(20, 40)), ["loading"] * 20


BAD = {
    "too few rows": (
        lambda folder: magnet(folder, rows_of(lab.magnet(), slice(7))),
        ("7 rows, too few", "expected 8 or more"),
    ),
    "one current": (
        lambda folder: magnet(folder, lab.magnet(currents=(0.5,))),
        ("all forces are at 0.5 A", "2 or more currents", "magnet.Bm"),
    ),
    "few displacements": (
        lambda folder: magnet(folder, lab.magnet(places=3)),
        ("3 different displacements", "expected 4 or more"),
    ),
    "never releases": (
        lambda folder: magnet(folder, holding()),
        ("never releases", "at best", "up to 0.2 A"),
    ),
    "currents of the other sign": (
        lambda folder: magnet(folder, {**lab.magnet(), "current": -lab.magnet()["current"]}, position=lab.B),
        ("the pull grows with the current",),
    ),
    "forces of the other sign": (
        lambda folder: magnet(folder, {**lab.magnet(), "force": -lab.magnet()["force"]}),
        ("expected",),
    ),
    "behind the origin": (
        lambda folder: magnet(folder, {**lab.magnet(), "displacement": lab.magnet()["displacement"] - 6e-5}),
        ("line 2", "expected more than 0 m"),
    ),
    "noise alone": (
        lambda folder: magnet(folder, noisy(lab.magnet(), "force", 40.0)),
        ("expected",),
    ),
    "spring: too few rows": (
        lambda folder: spring_only(folder, rows_of(lab.spring(), slice(4))),
        ("4 rows, too few", "5 or more"),
    ),
    "spring: one place": (
        lambda folder: spring_only(folder, {**lab.spring(), "displacement": np.full(15, 1e-4)}),
        ("1 different displacements",),
    ),
    "spring: rising": (
        lambda folder: spring_only(folder, {**lab.spring(), "force": lab.spring()["displacement"]}),
        ("rises", "expected a force toward the paper that decreases"),
    ),
    "spring: zeros": (
        lambda folder: spring_only(folder, {**lab.spring(), "force": np.zeros(15)}),
        ("every force is 0",),
    ),
    "spring: no constant": (
        lambda folder: spring_only(folder, noisy(lab.spring(), "force", 100.0, seed=4)),
        ("expected",),
    ),
    "pack: falling": (
        lambda folder: pack_only(folder, *falling()),
        ("loading branch falls", "(line ", "expected growing values"),
    ),
    "pack: loading that goes out": (
        lambda folder: pack_only(folder, *turned_round()),
        ("lines 2 to 21 are loading", "indentation falls"),
    ),
    "pack: no loading": (
        lambda folder: pack_only(folder, rows_of(lab.pack()[0], slice(20, 40)), ["unloading"] * 20),
        ("0 rows of loading", "to fit the stiffness"),
    ),
    "pack: negative": (
        lambda folder: pack_only(folder, {**lab.pack()[0], "force": -lab.pack()[0]["force"]}, lab.pack()[1]),
        ("expected",),
    ),
    "pack: too few rows": (
        lambda folder: pack_only(folder, rows_of(lab.pack()[0], slice(4)), ["loading"] * 4),
        ("4 rows, too few",),
    ),
    "backstop: too few rows": (
        lambda folder: fit_backstop(write(folder / "magnet.csv", lab.rebounds(5))),
        ("5 rows, too few",),
    ),
    "backstop: faster than before": (
        lambda folder: fit_backstop(
            write(
                folder / "magnet.csv",
                {**lab.rebounds(), "rebound speed": 1.1 * lab.rebounds()["impact speed"]},
            )
        ),
        ("1.1 times as fast", "expected rebounds slower than impacts"),
    ),
    "backstop: signs": (
        lambda folder: fit_backstop(
            write(
                folder / "magnet.csv",
                {**lab.rebounds(), "impact speed": -lab.rebounds()["impact speed"]},
            )
        ),
        ("'impact speed'", "expected a positive speed"),
    ),
    "backstop: one speed": (
        lambda folder: fit_backstop(
            write(folder / "magnet.csv", rows_of(lab.rebounds(200), slice(100, 120)))
        ),
        ("expected a span of 1.5 times",),
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_data_in_one_sentence(tmp_path: Path, name: str) -> None:
    call, said = BAD[name]
    with pytest.raises(InputError) as caught:
        call(tmp_path)
    text = str(caught.value)
    assert "\n" not in text
    assert all(word in text for word in ("magnet.csv", *said)), text


def test_missing_pieces_in_one_sentence(tmp_path: Path) -> None:
    spring = write(tmp_path / "s.csv", lab.spring())
    with refused("position"):
        magnet(tmp_path, spring=spring)
    with refused("backstop"):
        fit_backstop()
    columns, branch = lab.pack()
    loading = np.array(branch) == "loading"
    table = write(tmp_path / "p.csv", {name: values[loading] for name, values in columns.items()})
    assert "not tested" in fit_pack(table, thickness=lab.THICKNESS).remarks[0]
    with refused("rows"):
        fit_pack(table, thickness=lab.THICKNESS, exponents=True)
    for bodies, key in (
        (([(1e-3, 0.0)], [(1e9, 0.0)], [(0.3, 0.0)] * 2), "Young's modulus"),
        (([(1e-3, 0.0)] * 3, [(1e9, 0.0)] * 2, [(0.3, 0.0)] * 2), "radius"),
        (([(-1e-3, 0.0)], [(1e9, 0.0)] * 2, [(0.3, 0.0)] * 2), "radius"),
        (([(1e-3, 0.0)], [(1e9, 0.0)] * 2, [(0.3, 0.0), (0.6, 0.0)]), "Poisson ratio"),
    ):
        with refused(key):
            Stiffness.from_bodies(*bodies)
