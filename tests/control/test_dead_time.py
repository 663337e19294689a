"""Dead time against rail and temperature, for a shipped device; the header, read by a compiler."""

import dataclasses
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.errors import refused

import printhammer as ph
from printhammer.control.dead_time import DeadTime
from printhammer.control.pulses import of_width
from printhammer.run.contacts import Dot

RAILS, WARM = ["34 V", "38 V", "42 V"], ["20 degC", "90 degC"]


@pytest.fixture(scope="module")
def wire() -> ph.Hammer:
    return ph.load("impact-wire")


@pytest.fixture(scope="module")
def table(wire: ph.Hammer) -> DeadTime:
    return ph.dead_time(wire, voltage=RAILS, temperature=WARM, blow="2.9 m/s")


def dot_of(wire: ph.Hammer, volts: float, degrees: float, width: float) -> Dot:
    assert wire.waveform is not None
    coil = wire.replace("coil.temperature", degrees)
    pulse = of_width(wire.waveform.scaled(volts / 38.0), width)
    return ph.simulate(coil, ph.PulseTrain(pulse, at=[0.0]), duration="1 ms").dots[0]


def test_every_entry_gives_the_blow(wire: ph.Hammer, table: DeadTime) -> None:
    for i, volts in enumerate(table.voltage):
        for j, degrees in enumerate(table.temperature):
            dot = dot_of(wire, volts, degrees, table.width[i, j])
            assert dot.impact_speed == pytest.approx(2.9, rel=1e-6)
            assert dot.flight_time == pytest.approx(table.width_time[i, j], rel=1e-9)


def test_a_low_rail_and_a_warm_coil_come_later(table: DeadTime) -> None:
    for times in (table.time, table.width_time, table.width):
        assert (np.diff(times, axis=0) < 0.0).all()
        assert (np.diff(times, axis=1) > 0.0).all()
    # At one blow a warm coil costs more, the resistance counting more than the current.
    assert (np.diff(table.width_heat, axis=1) > 0.0).all()


def test_the_own_blow_needs_the_own_pulse(wire: ph.Hammer) -> None:
    own = ph.dead_time(wire, voltage=[38.0], temperature=[20.0])
    assert own.width[0, 0] == pytest.approx(own.own_width, rel=1e-6)
    assert own.time[0, 0] == pytest.approx(own.own_time, rel=1e-9)
    assert own.speed[0, 0] == pytest.approx(own.blow, rel=1e-9)


def test_a_driver_whose_shortest_pulse_outlasts_the_flight_gives_its_own_blow() -> None:
    """At the nominal rail any width gives the blow; a higher rail hits harder, a lower rail more weakly."""
    flipper = ph.load("pinball-flipper")
    table = ph.dead_time(flipper, voltage=[49.0, 50.0, 51.0], temperature=[20.0])
    assert np.isnan(table.width[[0, 2], 0]).all()
    assert table.strongest[0, 0] < table.blow < table.strongest[2, 0]
    assert flipper.waveform is not None
    pulse = of_width(flipper.waveform, float(table.width[1, 0]))
    dot = ph.simulate(flipper, ph.PulseTrain(pulse, at=[0.0]), duration="40 ms").dots[0]
    assert dot.impact_speed == pytest.approx(table.blow, rel=1e-6)
    assert "\nAt 1 of 3 pairs" in str(table)


def test_a_blow_out_of_reach_has_no_pulse(wire: ph.Hammer) -> None:
    table = ph.dead_time(wire, voltage=[20.0, 38.0], temperature=[20.0], blow=3.2)
    assert np.isnan(table.width[0, 0])
    assert table.strongest[0, 0] < 3.2
    assert table.width[1, 0] > 0.0
    assert "0, 0\n" not in table.to_header()  # One temperature, one number a row.


def test_the_header_compiles_and_says_the_same(table: DeadTime, tmp_path: Path) -> None:
    table.save(tmp_path / "dead.h")
    at = [(34000, 200), (36000, 200), (38000, 550), (50000, 0), (40000, 725)]
    name = "printhammer_impact_wire"
    lines = ['#include "dead.h"', "#include <stdio.h>", "int main(void) {"]
    for volts, tenths in at:
        calls = ", ".join(f"(int){name}_{each}_at({volts}, {tenths})" for each in ("width", "dead_time"))
        lines.append(f'  printf("%d %d\\n", {calls});')
    (tmp_path / "main.c").write_text("\n".join([*lines, "  return 0;", "}"]) + "\n")
    command = ["cc", "-std=c99", "-Wall", "-Wextra", "-Wunused-const-variable", "-Werror"]
    subprocess.run([*command, "-c", "-x", "c", "dead.h", "-o", "dead.o"], cwd=tmp_path, check=True)
    command += ["-o", "main", "main.c"]
    subprocess.run(command, cwd=tmp_path, check=True)
    said = subprocess.run([tmp_path / "main"], check=True, capture_output=True, text=True).stdout.splitlines()
    for (volts, tenths), line in zip(at, said, strict=True):
        for values, word in zip((table.width, table.width_time), line.split(), strict=True):
            along = [np.interp(volts / 1e3, table.voltage, column) for column in values.T]
            wanted = 1e9 * np.interp(tenths / 10.0, table.temperature, along)
            assert int(word) == pytest.approx(wanted, abs=4.0)


def test_a_pair_without_any_impact_is_not_among_those_that_reach_a_blow() -> None:
    table = ph.dead_time(ph.load("relay-5v"), voltage=[2.0, 5.0], temperature=[20.0])
    assert np.isnan(table.strongest[0, 0])
    assert table.reached == 0.0
    assert "strongest blow" not in str(table.summary())


def test_one_pair_makes_a_header_too(table: DeadTime, tmp_path: Path) -> None:
    names = [field.name for field in dataclasses.fields(table) if np.ndim(getattr(table, field.name)) == 2]
    one = dataclasses.replace(
        table,
        voltage=table.voltage[:1],
        temperature=table.temperature[:1],
        **{name: getattr(table, name)[:1, :1] for name in names},
    )
    (tmp_path / "one.h").write_text(one.to_header())
    (tmp_path / "one.c").write_text(
        '#include "one.h"\nint main(void) { return printhammer_impact_wire_between('
        "printhammer_impact_wire_width, 1, 1) <= 0; }\n"
    )
    command = ["cc", "-std=c99", "-Wall", "-Wextra", "-o", "one", "one.c"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    subprocess.run([tmp_path / "one"], check=True)


def test_what_has_no_rail_is_refused(hammer: ph.Hammer) -> None:
    with refused("waveform"):
        ph.dead_time(hammer)


@pytest.mark.parametrize(
    ("wrong", "key"),
    [
        ({"voltage": [-1.0]}, "voltage"),
        ({"temperature": ["300 K"]}, "temperature"),
        ({"blow": 0.0}, "blow"),
        ({"voltage": list(range(1, 202)), "temperature": list(range(100))}, "rails"),
    ],
)
def test_what_is_no_grid_is_refused(wire: ph.Hammer, wrong: dict[str, object], key: str) -> None:
    with refused(key):
        ph.dead_time(wire, **wrong)  # type: ignore[arg-type]


def test_a_run_that_ends_early_is_told(wire: ph.Hammer) -> None:
    # A soft paper lets the clapper come to its pole, where its law ends.
    soft = wire.replace({"pack.stiffness": "1 N/mm", "pack.damping": "0 N s/m"})
    table = ph.dead_time(soft, voltage=[38.0], temperature=[20.0], blow=2.0)
    assert table.status[0, 0] == "range left"
    assert table.to_dataframe()["status"].tolist() == ["range left"]
