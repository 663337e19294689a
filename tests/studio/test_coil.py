"""Coil settings of the studio: temperature, the winding of a hammer without a coil, drivers."""

import json

import pytest
from tests.hammers import CRUDE

import printhammer as ph
from printhammer.drive.waveforms.drivers import Rail
from printhammer.hammer.hammer import load
from printhammer.studio import controls
from printhammer.studio.coil import open_constants, rail_of


def test_a_hammer_without_a_coil_is_driven_by_a_rail_as_by_its_current() -> None:
    hammer = load("hendriks-1983")
    rail = rail_of(hammer)
    assert rail is not None
    further = {key: constant.si for key, (constant, _) in open_constants(hammer).items()}
    assert further.keys() == {"coil.resistance", "coil.inductance", "coil.temperature"}
    motion = ph.simulate(hammer.replace(further), ph.PulseTrain(Rail(**rail)))
    assert hammer.waveform is not None
    assert motion.curves_at(motion.t)[2].max() == pytest.approx(hammer.waveform.peak, rel=0.03)


@pytest.mark.parametrize("name", ["relay-5v", "hendriks-1983", "bouncing-ball", str(CRUDE)])
def test_open_constants_have_controls(name: str) -> None:
    hammer = load(name)
    described = controls.describe(hammer)
    assert [each["key"] for each in described["open"]] == list(open_constants(hammer))
    assert (described["rail"] is None) == (hammer.magnet is None)
    for each in described["open"]:
        assert each["low"] < each["value"] < each["high"]
        assert (each["section"], len(each["equation"]) > 10) == ("coil", True)
    assert json.dumps(controls.units_of(hammer))


def test_slow_and_large_devices_are_shown_in_larger_units() -> None:
    names = {
        name: [controls.units_of(load(name))[si][0]["name"] for si in ("s", "m")]
        for name in ("hendriks-1983", "relay-5v", "pinball-coil")
    }
    assert names == {"hendriks-1983": ["µs", "µm"], "relay-5v": ["ms", "µm"], "pinball-coil": ["ms", "mm"]}
