"""A known constant with an error widens the intervals of a fit, and remains correlated with them."""

import math
from pathlib import Path

import numpy as np
import pytest
from studies.recovery import true_value
from tests.hammers import CRUDE

import printhammer as ph

HAMMER = ph.load(CRUDE)


@pytest.mark.parametrize(
    ("kind", "taken", "found", "power"),
    [
        # The force of the pack is a function of its stiffness over the 2.7th power of the thickness; speeds
        # give the damping over the stiffness.
        ("pack", "pack.thickness", "pack.stiffness", 2.7),
        ("backstop", "backstop.stiffness", "backstop.damping", 1.0),
    ],
)
def test_of_one_constant(kind: str, taken: str, found: str, power: float, tmp_path: Path) -> None:
    table = tmp_path / f"{kind}.csv"
    ph.measure(kind, HAMMER, seed=3).write(table)
    share = 2e-3
    error = share * true_value(HAMMER, taken)
    unit = HAMMER.constants[taken].si_unit
    known = HAMMER.replace(
        "uncertainty",
        {
            "constants": ["mass", taken],
            "standard_errors": ["1e-6 kg", f"{error!r} {unit}"],
            "correlation": [[0.5]],
        },
    )
    exact, fit = (ph.fit(kind, table, hammer=each) for each in (HAMMER, known))
    added = power * share * exact[found].value
    assert fit[found].value == exact[found].value
    assert fit[found].standard_error == pytest.approx(
        math.hypot(exact[found].standard_error, added), rel=1e-3
    )
    assert np.diff(fit[found].interval) > np.diff(exact[found].interval)
    assert any(taken in remark for remark in fit.remarks)
    built = fit.into(known).uncertainty
    assert built is not None
    rows = [built.keys.index(key) for key in (found, taken, "mass")]
    covariance = built.covariance[np.ix_(rows, rows)]
    slope = added / error
    assert covariance[0, 0] == pytest.approx(fit[found].standard_error ** 2)
    assert covariance[0, 1] == pytest.approx(slope * error**2, rel=1e-3)
    assert covariance[0, 2] == pytest.approx(slope * 0.5 * error * 1e-6, rel=1e-3)
    # Given by itself the constant is exact.
    option = taken.rpartition(".")[2]
    again = ph.fit(kind, table, hammer=known, **{option: true_value(HAMMER, taken)})
    assert again[found].standard_error == exact[found].standard_error


def test_of_the_position_of_the_backstop(tmp_path: Path) -> None:
    """Bs is the force of the spring at the backstop, so it changes with the position by Bs / As."""
    table = tmp_path / "spring.csv"
    ph.measure("spring", HAMMER, seed=3).write(table)
    known = HAMMER.replace("uncertainty", {"constants": ["backstop.position"], "standard_errors": ["2 um"]})
    exact, fit = (ph.fit("spring", table, hammer=each) for each in (HAMMER, known))
    added = 2e-6 * exact["spring.Bs"].value / exact["spring.As"].value
    assert fit["spring.Bs"].standard_error == pytest.approx(
        math.hypot(exact["spring.Bs"].standard_error, added), rel=1e-6
    )


def test_of_a_coil_on_a_rail(tmp_path: Path) -> None:
    """A resistance from an earlier fit, two standard errors off, shifts the mass equally."""
    relay = ph.load("relay-5v")
    error = 2e-4 * true_value(relay, "coil.resistance")
    known = relay.replace("coil.resistance", true_value(relay, "coil.resistance") + 2.0 * error)
    known = known.replace(
        "uncertainty", {"constants": ["coil.resistance"], "standard_errors": [f"{error!r} ohm"]}
    )
    record = tmp_path / "motion.csv"
    sensor = {"sampling_rate": "200 kHz", "bandwidth": "1 MHz"}
    ph.measure("motion", relay, seed=2, sensor=sensor, duration=9e-3).write(record)
    exact, fit = (
        ph.fit("motion", record, hammer=each, free=["mass"], bandwidth="1 MHz")
        for each in (known.replace("uncertainty", None), known)
    )
    mass = true_value(relay, "mass")
    assert abs(exact["mass"].value - mass) > 4.0 * exact["mass"].standard_error
    assert abs(fit["mass"].value - mass) < 2.5 * fit["mass"].standard_error
    assert fit["coil.resistance"].standard_error < error
