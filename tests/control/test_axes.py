"""Tables along the gap: dots match the design, also between two values; the header compiles."""

import subprocess
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from tests.errors import refused

import printhammer as ph
from printhammer.control.axes import AxisTables, tune_along
from printhammer.control.table.compensation import JUMP
from printhammer.control.table.drive import COLUMNS
from printhammer.printing.dots.nominal import nominal
from printhammer.printing.rates.variability import Perturbation, perturbed

RATE = 1275.0
GAPS = ("-10 um", "0 um", "10 um")
SLOTS = (0, 1, 2, 4, 5, 8)
NEAR = (0, 1, 2, 5, 6, 9)
"""Slots of which none is two slots after another: tables of reach 1 have no history for these."""


@pytest.fixture(scope="module")
def steps() -> list[tuple[int, int]]:
    return []


@pytest.fixture(scope="module")
def tables(steps: list[tuple[int, int]]) -> AxisTables:
    return tune_along(
        ph.load("hendriks-1983-1"),
        "gap",
        GAPS,
        rate=RATE,
        history=1,
        reach=1,
        progress=lambda step, total: steps.append((step, total)),
    )


def check_dots(tables: AxisTables, gap: float, slots: tuple[int, ...]) -> None:
    """Check that dots on a hammer with another gap match the design."""
    hammer = ph.load("hendriks-1983-1")
    single = nominal(hammer)
    driven = perturbed(hammer, Perturbation(travel=gap))
    drive = tables.at(gap).strategy(hammer)(driven, [slots], RATE)[0]
    dots = ph.simulate(driven, drive).dots
    force = np.array([dot.peak_force for dot in dots], dtype=float) / single.force - 1.0
    touched = np.array([dot.fired_at + (dot.flight_time or 0.0) for dot in dots])
    late = touched - (1e-3 + np.array(slots) / RATE) - single.flight_time
    assert abs(force).max() < 0.05
    assert abs(late).max() < 15e-6


@pytest.mark.parametrize("gap", [-10e-6, 5e-6, 10e-6])
def test_dots_are_those_of_the_design(tables: AxisTables, gap: float) -> None:
    check_dots(tables, gap, NEAR)


@pytest.mark.slow
def test_dots_two_slots_apart_are_those_of_the_design() -> None:
    tables = tune_along(ph.load("hendriks-1983-1"), "gap", GAPS[1:], rate=RATE, history=1)
    for gap in (0.0, 5e-6, 10e-6):
        check_dots(tables, gap, SLOTS)


def test_progress_does_not_go_back(tables: AxisTables, steps: list[tuple[int, int]]) -> None:
    assert steps == sorted(steps)
    assert 0 < steps[-1][0] <= steps[-1][1]


def test_files_and_the_header(tables: AxisTables, tmp_path: Path) -> None:
    for name in ("t.h", "t.csv", "t.nc", "t.json"):
        tables.save(tmp_path / name)
        assert (tmp_path / name).stat().st_size > 0
    assert len(tables.to_dataframe()) == 3 * len(tables.tables[0].to_dataframe())
    text = tables.to_header("1 us", budget=tables.size("1 us"))
    (tmp_path / "t.h").write_text(text)
    prefix = "printhammer_hendriks_1983_1_1275hz_gap"
    entries = tables.tables[0].advance.shape[1]
    columns = [
        f"{prefix}_{name}"
        for name in (
            "gap",
            "rate",
            "advance",
            "width",
            "brake_delay",
            "brake_width",
            "look_ahead",
            "multiplier",
        )
    ]
    main = f"""
#include "t.h"
#include <stdio.h>
int main(void) {{
  size_t size = {" + ".join(f"sizeof {name}" for name in columns)};
  unsigned gaps[1] = {{1}};
  printf("%lu %u %u\\n", (unsigned long)size, {prefix.upper()}_BYTES, {prefix}_history(gaps));
  for (int i = 0; i < 3; i++) for (int j = 0; j < {entries}; j++)
    printf("%d %d %d\\n", (int){prefix}_gap[i], (int){prefix}_advance[i][0][j], (int){prefix}_width[i][0][j]);
  return 0;
}}
"""
    (tmp_path / "main.c").write_text(main)
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror"]
    subprocess.run(["cc", *flags, "-o", "main", "main.c"], cwd=tmp_path, check=True)
    said = subprocess.run([tmp_path / "main"], check=True, capture_output=True, text=True).stdout
    first, *rows = [[int(word) for word in line.split()] for line in said.splitlines()]
    assert first == [tables.size("1 us"), tables.size("1 us"), 1]
    whole = tables.quantised("1 us").tables
    wanted = [
        [round(value * 1e9), round(table.advance[0, j] * 1e6), round(table.width[0, j] * 1e6)]
        for value, table in zip(tables.values, whole, strict=True)
        for j in range(entries)
    ]
    assert rows == wanted


def test_each_table_states_the_multipliers_of_its_hammer(tables: AxisTables) -> None:
    """The drives of the strategy at a value equal those of the hammer that was tuned there."""
    again = tables.with_multipliers(ph.load("hendriks-1983-1"))
    for table, other in zip(tables.tables, again.tables, strict=True):
        assert np.isfinite(table.multiplier).all()
        assert other.multiplier == pytest.approx(table.multiplier, abs=1e-3)
    assert np.ptp([table.multiplier[0, 1] for table in tables.tables]) > 1e-3


def ticks_between(tables: AxisTables, tick: float, value: int) -> list[list[int]]:
    """Interpolate the times of all histories at a value, nm, in ticks, with integer arithmetic."""
    places = [round(place * 1e9) for place in tables.values]
    after = next((k for k, place in enumerate(places) if k and value <= place), len(places) - 1)
    share = Fraction(
        min(max(value, places[0]), places[-1]) - places[after - 1], places[after] - places[after - 1]
    )
    rows = []
    for low, high in zip(
        *(np.array([getattr(tables.tables[k], name)[0] for name in COLUMNS]).T for k in (after - 1, after)),
        strict=True,
    ):
        first, second = ([round(time / tick) for time in each] for each in (low, high))
        apart = abs(first[0] - second[0]) * tick > JUMP + 1e-12 or first[2:] != second[2:]
        part = Fraction(int(share > Fraction(1, 2))) if apart else share
        sums = [(1 - part) * a + part * b for a, b in zip(first, second, strict=True)]
        rows.append([int(abs(each) + Fraction(1, 2)) * (1 if each >= 0 else -1) for each in sums])
    return rows


@pytest.mark.parametrize("tick", ["1 ns", "1 us", "5 us"])
def test_firmware_interpolates_to_the_tick(tables: AxisTables, tmp_path: Path, tick: str) -> None:
    unit = {"1 ns": 1e-9, "1 us": 1e-6, "5 us": 5e-6}[tick]
    # One history is fired in another way at the last value, and has another brake in another.
    last = tables.tables[-1]
    advance, brake, delay = last.advance.copy(), last.brake_width.copy(), last.brake_delay.copy()
    advance[0, 1] += 30e-6
    brake[0, 0], delay[0, 0] = 20e-6, 600e-6
    odd = replace(
        tables,
        tables=(*tables.tables[:-1], replace(last, advance=advance, brake_width=brake, brake_delay=delay)),
    )
    (tmp_path / "t.h").write_text(odd.to_header(tick))
    entries, values = (
        last.advance.shape[1],
        [-12000, -10000, -7001, -1, 0, 1, 3333, 4999, 5001, 7777, 10000, 11000],
    )
    prefix = "printhammer_hendriks_1983_1_1275hz_gap"
    (tmp_path / "main.c").write_text(f"""
#include "t.h"
#include <stdio.h>
int main(void) {{
  static const int32_t value[] = {{{", ".join(map(str, values))}}};
  for (unsigned i = 0; i < {len(values)}u; i++) for (unsigned j = 0; j < {entries}u; j++) {{
    unsigned gaps[1] = {{j}};
    int32_t t[4];
    {prefix}_times(value[i], 0u, {prefix}_history(gaps), t);
    printf("%ld %ld %ld %ld\\n", (long)t[0], (long)t[1], (long)t[2], (long)t[3]);
  }}
  return (int)({prefix}_rate[0] != 1275000u);
}}
""")
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic"]
    subprocess.run(["cc", *flags, "-o", "main", "main.c"], cwd=tmp_path, check=True)
    said = subprocess.run([tmp_path / "main"], check=True, capture_output=True, text=True).stdout
    rows = np.array([[int(word) for word in line.split()] for line in said.splitlines()])
    fired = rows.reshape(len(values), entries, 4)
    held = odd.quantised(tick)
    for place, value in enumerate(values):
        assert fired[place].tolist() == ticks_between(held, unit, value)
        if abs(value) <= 10000:
            at = held.at(value * 1e-9)
            exact = np.array([getattr(at, column)[0] for column in COLUMNS]).T / unit
            # To the tick: what Python fires at this value, rounded.
            assert abs(fired[place] - exact).max() <= 0.5 + 1e-6


def test_bad_axes_are_refused(tables: AxisTables, behind_a_rail: ph.Hammer) -> None:
    hammer = ph.load("hendriks-1983-1")
    for axis, values, key in (
        ("weather", GAPS, "axis"),
        ("rail", ("90 V", "100 V"), "rail.axis"),
        ("temperature", ("20 degC", "80 degC"), "temperature.axis"),
        ("gap", GAPS[:1], "gap"),
        ("gap", GAPS[::-1], "gap"),
    ):
        with refused(key):
            tune_along(hammer, axis, values, rate=RATE)
    with refused("rail.waveform"):
        tune_along(behind_a_rail, "rail", ["100 V", "130 V"], rate=RATE, largest_current="2 A")
    with refused("gap"):
        tables.at("30 um")
    with refused("budget"):
        tables.to_header(budget=1)


@pytest.fixture(scope="module")
def behind_a_rail() -> ph.Hammer:
    coil = {"resistance": 28.6, "inductance": "6.547 mH"}
    rail = {"shape": "rail", "voltage": 100.0, "width": "177.24 us", "decay_resistance": "159.1 ohm"}
    return ph.load("hendriks-1983-1").replace({"coil": coil, "waveform": rail})


@pytest.mark.slow
def test_between_two_rails_dots_are_those_of_the_design(behind_a_rail: ph.Hammer) -> None:
    tables = tune_along(behind_a_rail, "rail", ["94 V", "100 V"], rate=RATE, history=1)
    single = nominal(behind_a_rail)
    for volts in (94.0, 97.0, 100.0):
        drive = tables.strategy(behind_a_rail, volts)(behind_a_rail, [SLOTS], RATE)[0]
        dots = ph.simulate(behind_a_rail.replace("waveform.voltage", volts), drive).dots
        force = np.array([dot.peak_force for dot in dots], dtype=float) / single.force - 1.0
        touched = np.array([dot.fired_at + (dot.flight_time or 0.0) for dot in dots])
        late = touched - (1e-3 + np.array(SLOTS) / RATE) - single.flight_time
        assert abs(force).max() < 0.05
        assert abs(late).max() < 15e-6


def test_a_warm_coil_is_on_longer(behind_a_rail: ph.Hammer) -> None:
    tables = tune_along(
        behind_a_rail, "temperature", ["20 degC", "80 degC"], rate="600 Hz", history=1, reach=1
    )
    cold, warm = tables.tables
    assert warm.width[0, 0] > cold.width[0, 0] + 3e-6
    single = nominal(behind_a_rail)
    driven = behind_a_rail.replace("coil.temperature", "50 degC")
    drive = tables.strategy(behind_a_rail, "50 degC")(driven, [(0, 1, 2)], 600.0)[0]
    for dot in ph.simulate(driven, drive).dots:
        assert dot.peak_force == pytest.approx(single.force, rel=0.05)
