"""The picture of a fit, compared with the fit."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from tests import measurements as lab
from tests.errors import refused
from tests.measurements import write

from printhammer.figures.fit import plot
from printhammer.identify.static.backstop import Stiffness, fit_backstop
from printhammer.identify.static.magnet import fit_magnet
from printhammer.identify.static.pack import fit_pack


def texts(figure: Figure) -> str:
    words = [text.get_text() for ax in figure.axes for text in ax.texts]
    title = figure.get_suptitle()
    return " ".join([*words, title])


def test_data_residuals_and_outliers(tmp_path: Path) -> None:
    columns = lab.magnet()
    columns["force"] = columns["force"] + 0.1 * np.random.default_rng(0).standard_normal(60)
    columns["force"][7] += 3.0
    fit = fit_magnet(write(tmp_path / "m.csv", columns))
    figure = plot(fit)
    data, residuals, correlation, quantiles = figure.axes[:4]
    drawn = np.concatenate([line.get_ydata() for line in data.lines[: 2 * 5 : 2]])
    np.testing.assert_allclose(np.sort(drawn), np.sort(fit.data[~fit.outliers]))
    legend = data.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["0 A", "0.5 A", "1 A", "1.5 A", "2 A"]
    assert "line 9" in texts(figure)
    shown = np.concatenate([line.get_ydata() for line in residuals.lines[1:6]])
    np.testing.assert_allclose(np.sort(shown), np.sort(fit.residuals[~fit.outliers]))
    np.testing.assert_array_equal(correlation.images[0].get_array(), fit.correlation)
    assert len(quantiles.lines[1].get_ydata()) == 59


def test_every_unloading_has_its_curve(tmp_path: Path) -> None:
    columns, branch = lab.pack()
    noise = 0.2 * np.random.default_rng(0).standard_normal(len(branch))
    table = write(tmp_path / "p.csv", {**columns, "force": columns["force"] + noise}, branch)
    figure = plot(fit_pack(table, thickness=lab.THICKNESS))
    legend = figure.axes[0].get_legend()
    assert legend is not None
    names = [text.get_text() for text in legend.get_texts()]
    assert names == ["loading", "unloading 1", "unloading 2", "unloading 3"]


def test_a_rejected_law_is_told(tmp_path: Path) -> None:
    columns = lab.rebounds()
    noise = 1 + 0.01 * np.random.default_rng(1).standard_normal(30)
    columns["rebound speed"] = 0.7 * columns["impact speed"] * noise
    figure = plot(fit_backstop(write(tmp_path / "r.csv", columns)))
    assert "The data reject the law" in texts(figure)


def test_exact_data_can_be_drawn(tmp_path: Path) -> None:
    figure = plot(fit_magnet(write(tmp_path / "m.csv", lab.magnet())))
    figure.savefig(tmp_path / "exact.png")


def test_bodies_have_nothing_to_draw() -> None:
    with refused("table"):
        plot(fit_backstop(stiffness=Stiffness(1e9, 0.0, "computed")))
