"""Standard errors and correlations in hammer files."""

from pathlib import Path

import numpy as np
import pytest
from tests.errors import refused

import printhammer as ph

TABLE = {
    "constants": ["mass", "pack.thickness", "backstop.damping"],
    "standard_errors": ["1 mg", "1 um", "2e8 N s/m^2.5"],
    "correlation": [[0.5], [-0.25, 0.125]],
}


@pytest.fixture
def known(hammer: "ph.Hammer") -> "ph.Hammer":
    return hammer.replace("uncertainty", TABLE)


def test_the_covariance_is_in_si(known: "ph.Hammer") -> None:
    found = known.uncertainty
    assert found is not None
    assert found.keys == tuple(TABLE["constants"])
    errors = np.array([1e-6, 1e-6, 2e8])
    correlation = np.array([[1.0, 0.5, -0.25], [0.5, 1.0, 0.125], [-0.25, 0.125, 1.0]])
    np.testing.assert_allclose(found.covariance, correlation * np.outer(errors, errors), rtol=1e-12)
    assert found.error("pack.thickness") == pytest.approx(1e-6)
    assert found.error("magnet.F0") == 0.0


def test_it_is_written_and_read_and_no_physics(known: "ph.Hammer", tmp_path: Path) -> None:
    known.save(tmp_path / "known.toml")
    again = ph.load(tmp_path / "known.toml")
    assert again == known
    assert again.uncertainty is not None
    assert known.uncertainty is not None
    np.testing.assert_array_equal(again.uncertainty.covariance, known.uncertainty.covariance)
    exact = again.replace("uncertainty", None)
    assert exact.uncertainty is None
    assert exact.fingerprint == known.fingerprint
    assert "uncertainty" not in exact.to_toml()


def test_what_is_set_anew_loses_its_error(known: "ph.Hammer", tmp_path: Path) -> None:
    changed = known.replace("mass", "1.2 g")
    found = changed.uncertainty
    assert found is not None
    assert found.keys == ("pack.thickness", "backstop.damping")
    assert found.covariance[0, 1] == pytest.approx(0.125 * 1e-6 * 2e8)
    changed.save(tmp_path / "changed.toml")
    assert ph.load(tmp_path / "changed.toml") == changed
    alone = changed.replace({"pack": None, "backstop.damping": 3e10})
    assert alone.uncertainty is None


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"constants": ["mass", "pack.width", "platen"]}, "uncertainty.constants"),
        ({"constants": ["mass", "mass", "platen"]}, "uncertainty.constants"),
        ({"constants": "mass"}, "uncertainty.constants"),
        ({"standard_errors": ["1 mg"]}, "uncertainty.standard_errors"),
        ({"standard_errors": ["1 mg", "1 um", "0 N s/m^2.5"]}, "uncertainty"),
        ({"standard_errors": ["1 mg", "1 N", "2e8 N s/m^2.5"]}, "uncertainty"),
        ({"correlation": [[0.5]]}, "uncertainty.correlation"),
        ({"correlation": [[0.5], [0.5, 1.5]]}, "uncertainty.correlation"),
        ({"correlation": [[1.0], [1.0, -1.0]]}, "uncertainty.correlation"),
        ({"errors": []}, "uncertainty.errors"),
    ],
)
def test_what_is_wrong_is_named(hammer: "ph.Hammer", change: dict[str, object], key: str) -> None:
    with refused(key):
        hammer.replace("uncertainty", {**TABLE, **change})
