"""Every result class: declared once, identical in every file format."""

import json
import pkgutil
import re
from dataclasses import FrozenInstanceError
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from tests.errors import refused
from tests.result_samples import SAMPLES

import printhammer
from printhammer.figures.plots import PLOTS
from printhammer.hammer.hammer import Hammer
from printhammer.results import (
    ENDINGS,
    KEYS,
    RESULTS,
    Declared,
    Result,
    column,
    coordinate,
    derived,
    part,
    reopen,
    scalar,
)
from printhammer.results.files import plain
from printhammer.results.provenance import VERSIONS
from printhammer.support.arrays import FloatArray

_FIGURES = Path(printhammer.__file__).parent / "figures"

WITHOUT_PICTURE = {
    "DotTable",
    "EnsembleResult",
    "ExtraDots",
    "Measurement",
    "RecordedImpacts",
    "Spread",
    "Strobes",
}


@pytest.fixture(scope="module")
def samples(hammer: Hammer) -> dict[str, Result]:
    return {}


@pytest.fixture(params=sorted(SAMPLES))
def result(request: pytest.FixtureRequest, hammer: Hammer, samples: dict[str, Result]) -> Result:
    if request.param not in samples:
        samples[request.param] = SAMPLES[request.param](hammer)
    return samples[request.param]


def same(left: Any, right: Any) -> bool:
    """Whether attributes are equal; NaN equals NaN."""
    if isinstance(left, dict):
        return left.keys() == right.keys() and all(same(left[key], right[key]) for key in left)
    if isinstance(left, list):
        return len(left) == len(right) and all(map(same, left, right))
    return bool(left == right or (pd.isna(left) and pd.isna(right)))


def test_no_class_is_forgotten() -> None:
    for module in pkgutil.walk_packages(printhammer.__path__, "printhammer."):
        # Kernels are templates; what runs or shows results has none of its own.
        if module.name.split(".")[1] not in ("__main__", "bench", "cli", "kernel", "studio"):
            import_module(module.name)
    ours = {name for name, made in RESULTS.items() if made.__module__.startswith("printhammer.")}
    assert ours == set(SAMPLES)


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_result_is_saved_and_opened_again(result: Result, ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"result{ending}"
    if ending not in result.ENDINGS:
        with refused(None, file=path) as error:
            result.save(path)
        assert all(known in str(error.value) for known in result.ENDINGS)
        assert not path.exists()
        return
    result.save(path)
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]
    found = reopen(path)
    assert found.provenance == plain(result.provenance)
    assert same(found.attributes, plain(result.attributes))
    if ending in (".csv", ".parquet"):
        table = result.to_dataframe()
        assert list(found.dataframe) == list(table)
        for head in table:
            values = table[head].to_numpy()
            np.testing.assert_array_equal(found.dataframe[head].to_numpy().astype(values.dtype), values)
        return
    dataset = result.to_dataset()
    assert found.dataset.sizes == dataset.sizes
    for name, values in dataset.variables.items():
        np.testing.assert_array_equal(found.dataset[name].values.astype(values.dtype), values.values)
        assert found.dataset[name].dims == values.dims
        assert found.dataset[name].attrs == values.attrs


def test_a_csv_can_be_read_by_others(result: Result, tmp_path: Path) -> None:
    path = tmp_path / "result.csv"
    if ".csv" in result.ENDINGS:
        result.save(path)
        assert list(pd.read_csv(path, comment="#")) == list(result.to_dataframe())


def test_json_is_strict(result: Result, tmp_path: Path) -> None:
    def refuse(name: str) -> None:
        raise AssertionError(name)

    path = tmp_path / "result.json"
    if ".json" in result.ENDINGS:
        result.save(path)
        json.loads(path.read_text("utf-8"), parse_constant=refuse)


def test_there_is_one_set_of_keys(result: Result) -> None:
    keys = list(result.provenance)
    assert keys == [key for key in KEYS if key in keys]
    assert set(VERSIONS) <= set(keys)
    assert result.attributes["result"] == type(result).__name__


def test_every_array_has_unit_and_meaning(result: Result) -> None:
    for name, values in result.to_dataset().variables.items():
        assert values.attrs["long_name"], name
        assert values.dtype.kind in "US" or values.attrs["units"], name


def test_the_docstring_tells_of_every_field(result: Result) -> None:
    doc = type(result).__doc__ or ""
    for name in getattr(type(result), "__dataclass_fields__", {}):
        assert re.search(rf"^{name} : \S", doc, re.MULTILINE), name
    assert doc.count("Attributes\n") <= 1


def test_a_notebook_shows_it(result: Result) -> None:
    html = result._repr_html_()
    assert html.startswith("<div>")
    assert all(name in html for name in result.provenance)
    assert len(html) < 20_000


def test_there_is_a_picture(result: Result) -> None:
    name = type(result).__name__
    assert (name in PLOTS) != (name in WITHOUT_PICTURE)


@pytest.mark.parametrize("place", PLOTS.values())
def test_the_function_of_a_picture_is_there(place: str) -> None:
    module, _, function = place.rpartition(".")
    assert callable(getattr(import_module(f"printhammer.figures.{module}"), function))


@pytest.fixture
def falls() -> Result:
    class Falls(Result, rows="stone place", endings=(".nc", ".csv", ".json")):
        """Falls of stones.

        Notes
        -----
        In a vacuum.
        """

        stone: tuple[str, ...] = coordinate("", "name of the stone", "stone")
        height: FloatArray = coordinate("m", "height of the fall", "place")
        time: FloatArray = column("s", "time of the fall", "stone place", more="nan where it did not land")
        landed: FloatArray = column("1", "whether it landed", "stone place", codes=("no", "yes"))
        air: dict[str, float] = scalar("", "what was in the way")
        tolerance: float = part("error allowed")

        @property
        @derived("s", "longest fall", "stone", name="longest")
        def maximum(self) -> FloatArray:
            """Longest fall of a stone, s."""
            longest: FloatArray = np.nanmax(self.time, axis=1)
            return longest

        @property
        @derived("m", "sum of the heights")
        def total(self) -> float:
            """Sum of the heights, m."""
            return float(self.height.sum())

    RESULTS.pop("Falls")
    return Falls(
        ("round", "flat"),
        np.array([1.0, 4.0, 9.0]),
        np.array([[1.0, 2.0, np.nan], [0.1, np.inf, 3.0]]),
        np.array([[1, 1, 0], [1, 0, 1]]),
        {"density": np.nan, "kind": "none"},  # type: ignore[dict-item]
        1e-9,
    )


def test_what_a_class_declares(falls: Result, tmp_path: Path) -> None:
    dataset = falls.to_dataset()
    assert dict(dataset.sizes) == {"stone": 2, "place": 3}
    assert set(dataset.coords) == {"stone", "height"}
    assert dataset["longest"].attrs == {"units": "s", "long_name": "longest fall"}
    assert dataset["landed"].attrs["codes"] == "0 no, 1 yes"
    assert "units" not in dataset["stone"].attrs
    assert dataset.attrs["total"] == 14.0
    assert "maximum" not in dataset.attrs
    table = falls.to_dataframe()
    assert list(table) == ["stone", "height [m]", "time [s]", "landed", "longest [s]"]
    assert table["stone"].tolist() == ["round"] * 3 + ["flat"] * 3
    assert table["height [m]"].tolist() == [1.0, 4.0, 9.0] * 2
    assert table["landed"].tolist() == ["yes", "yes", "no", "yes", "no", "yes"]
    assert table["longest [s]"].tolist() == [2.0] * 3 + [np.inf] * 3
    doc = type(falls).__doc__ or ""
    assert "time : array, shape (stone, place)\n    Time of the fall, s; nan where it did not land.\n" in doc
    assert doc.index("Attributes") < doc.index("Notes")
    for ending in falls.ENDINGS:
        falls.save(tmp_path / f"falls{ending}")
        found = reopen(tmp_path / f"falls{ending}")
        assert same(found.attributes, plain(falls.attributes))
        np.testing.assert_array_equal(found.dataframe["time [s]"], table["time [s]"])
    with xr.open_dataset(tmp_path / "falls.nc", engine="scipy") as kept:
        assert kept.attrs["air"] == '{"density": null, "kind": "none"}'
    with refused(None, file="falls.zarr"):
        falls.save(tmp_path / "falls.zarr")
    with pytest.raises(AttributeError, match="Falls has no figure"):
        falls.plot()


def test_files_that_are_no_results(tmp_path: Path) -> None:
    for name, content, key in (
        ("a.txt", "", None),
        ("a.json", "[]", "columns"),
        ("b.json", "{", None),
        ("a.nc", "nothing", None),
        ("a.csv", "", "rows"),
        ("b.csv", "a,b\n1\n", "rows"),
    ):
        path = tmp_path / name
        path.write_text(content)
        with refused(key):
            reopen(path)
    with refused(None, file="none.nc"):
        reopen(tmp_path / "none.nc")


def test_a_table_without_provenance_opens(tmp_path: Path) -> None:
    path = tmp_path / "old.csv"
    path.write_text("t [s],n,name,ok\n0.1,1,a,True\n,2,,False\n")
    found = reopen(path)
    assert found.provenance == {}
    np.testing.assert_array_equal(found.dataset["t"], [0.1, np.nan])
    assert found.dataset["t"].attrs == {"units": "s"}
    assert found.dataframe["n"].tolist() == [1, 2]
    assert found.dataframe["name"].tolist() == ["a", ""]
    assert found.dataframe["ok"].tolist() == [True, False]


def test_a_row_of_gaps_is_a_row(tmp_path: Path) -> None:
    path = tmp_path / "gaps.csv"
    path.write_text("x [m],y [m]\n1,2\n,\n3,4\n")
    np.testing.assert_array_equal(reopen(path).dataset["x"], [1.0, np.nan, 3.0])


def test_values_that_belong_together_are_declared_alike() -> None:
    class Stone(Declared):
        """A stone."""

        mass: float = scalar("kg", "mass")
        shape: str = part("shape", more="as a word", default="round")

    stone = Stone(2.0)
    assert stone == Stone(2.0, "round")
    assert hash(stone) == hash(Stone(2.0, "round"))
    with pytest.raises(FrozenInstanceError):
        stone.mass = 3.0  # type: ignore[misc]
    section = "mass : float\n    Mass, kg.\nshape : str\n    Shape; as a word.\n"
    assert Stone.__doc__ == f"A stone.\n\nAttributes\n----------\n{section}"
    assert "Stone" not in RESULTS


def test_print_and_notebook_show_the_same_summary(result: Result) -> None:
    summary = result.summary()
    assert str(result) == f"{result.title}\n{summary.text()}"
    assert summary.text("inch").count("\n") == summary.text().count("\n")
    assert summary._repr_html_() in result._repr_html_()
    assert not set("⟦⟧⟪⟫") & set(summary.text() + result._repr_html_())
