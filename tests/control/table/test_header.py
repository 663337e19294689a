"""C headers in timer ticks: they compile without warnings and agree with Python to the tick."""

import math
import re
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.control.table.by_hand import by_hand
from tests.errors import refused

from printhammer.control.table.compensation import CompensationTable
from printhammer.control.table.drive import (
    COLUMNS,
    histories,
    number_of,
    numbers_before,
    pattern_of,
    pulses_of,
    shared_numbers,
)
from printhammer.control.table.header import look_ahead
from printhammer.printing.dots.strategy import FIRST_SLOT

TICKS = ("1 ns", "1 us", "5 us")
PREFIX = "printhammer_hendriks_1983_800_1000hz"
PAGE = Path(__file__).parents[3] / "docs" / "howto" / "tables.md"


def run_c(folder: Path, text: str) -> list[list[int]]:
    """Compile a program without warnings, run it, and return the integers that it prints."""
    (folder / "main.c").write_text(text)
    flags = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Wunused-const-variable=2", "-Werror"]
    subprocess.run(["cc", *flags, "-o", "main", "main.c"], cwd=folder, check=True)
    said = subprocess.run([folder / "main"], check=True, capture_output=True, text=True).stdout
    return [[int(word) for word in line.split()] for line in said.splitlines()]


@pytest.mark.parametrize("tick", TICKS)
def test_a_driver_in_c_agrees_to_the_tick(tmp_path: Path, tick: str) -> None:
    table = by_hand()
    (tmp_path / "table.h").write_text(table.to_header(tick))
    name = PREFIX
    rates, entries = table.advance.shape
    lines = [
        '#include "table.h"',
        "#include <stdio.h>",
        "int main(void) {",
        f"  size_t size = sizeof {name}_rate;",
    ]
    lines.append(f"  for (int i = 0; i < {rates}; i++) for (int j = 0; j < {entries}; j++)")
    every = ", ".join(f"(long){name}_{column}[i][j]" for column in COLUMNS)
    lines.append(f'    printf("%ld %ld %ld %ld\\n", {every});')
    lines += [f"  size += sizeof {name}_{column};" for column in (*COLUMNS, "look_ahead", "multiplier")]
    lines += [
        f"  unsigned gaps[{table.gaps}] = {{0}};",
        f'  printf("%lu %u %u\\n", (unsigned long)size, {name.upper()}_BYTES, {name}_history(gaps));',
        "  return 0;",
        "}",
    ]
    *rows, last = run_c(tmp_path, "\n".join(lines) + "\n")
    unit = {"1 ns": 1e-9, "1 us": 1e-6, "5 us": 5e-6}[tick]
    wanted = np.stack([np.rint(getattr(table, column) / unit) for column in COLUMNS], axis=2)
    # The widest pulse is rounded down, since its current may be the largest that is allowed.
    widest = np.floor((float(table.width.max()) + 1e-9) / unit)
    wanted[..., COLUMNS.index("width")] = np.minimum(wanted[..., COLUMNS.index("width")], widest)
    assert np.array_equal(np.array(rows).reshape(rates, entries, 4), wanted)
    assert last == [table.size(tick), table.size(tick), 0]
    exact = table.quantised(tick)
    for column, values in zip(COLUMNS, np.moveaxis(wanted, 2, 0), strict=True):
        assert getattr(exact, column) == pytest.approx(values * unit, abs=1e-15)


def test_short_times_take_half_the_bytes() -> None:
    table = by_hand()
    # Rates of four bytes, and for each entry a byte of look-ahead and a multiplier of two bytes, are as long
    # with every tick.
    others = 4 * table.rates.size + 3 * table.advance.size
    assert table.size("1 us") - others == (table.size() - others) // 2
    assert f"int16_t {PREFIX}_advance" in table.to_header("1 us")
    assert "TICK_NS 5000" in table.to_header("5 us")
    assert f"int16_t {PREFIX}_advance" not in table.to_header()


def test_a_budget_and_a_tick_are_kept_to() -> None:
    table = by_hand()
    assert table.to_header("1 us", budget=table.size("1 us"))
    with refused("budget"):
        table.to_header("1 us", budget=10)
    for tick in ("0.5 ns", 1.5e-9, "-1 us"):
        with refused("tick"):
            table.size(tick)


def braked(**changes: Any) -> CompensationTable:
    """A table with invented entries and brake pulses; at the second rate, one history uses another candidate.

    Dots from rest, one slot and two slots after another have a brake pulse.
    """
    table = by_hand()
    values = {name: getattr(table, name).copy() for name in COLUMNS}
    for history, delay in (((0, 0), 750e-6), ((1, 1), 700e-6), ((2, 0), 700e-6)):
        number = number_of(history, 2)
        values["brake_width"][:, number], values["brake_delay"][:, number] = 20e-6, delay
    values["advance"][1, number_of((2, 1), 2)] += 30e-6
    return replace(table, **values, **changes)


@pytest.mark.parametrize("seed", range(20))
def test_pulses_that_touch_do_not_overlap_in_whole_ticks(seed: int) -> None:
    """The brake pulse begins at the end of the preceding pulse, and ends at the firing of the dot."""
    rng = np.random.default_rng(seed)
    table = by_hand()
    values = {name: getattr(table, name) + rng.uniform(0.0, 4e-6, table.advance.shape) for name in COLUMNS}
    shared = shared_numbers(table.gaps, table.reach)
    values = {name: each[:, shared] for name, each in values.items()}
    for row, rate in enumerate(table.rates.tolist()):
        for history in histories(table.gaps, table.reach):
            cell, before = (row, number_of(history, table.reach)), numbers_before(history, table.reach)
            values["brake_delay"][cell] = (
                values["width"][row, before] - values["advance"][row, before]
            ).max()
            begun = history[0] / rate - values["advance"][cell]
            values["brake_width"][cell] = begun - values["brake_delay"][cell] if history[0] else 50e-6
    exact = replace(table, **{name: each[:, shared] for name, each in values.items()})
    for tick in (1e-6, 2e-6, 5e-6):
        # A table whose pulses overlap is refused when it is made.
        whole = exact.quantised(tick)
        for name in COLUMNS:
            each = getattr(whole, name)
            assert np.abs(each / tick - np.rint(each / tick)).max() < 1e-6
            assert np.abs(each - getattr(exact, name)).max() <= 2.5 * tick
            np.testing.assert_array_equal(getattr(whole.quantised(tick), name), each)
        # The current of the widest pulse may be the largest that is allowed.
        widest = max(float(exact.width.max()), float(exact.brake_width.max()))
        assert max(float(whole.width.max()), float(whole.brake_width.max())) <= widest + 1e-9


@pytest.mark.parametrize("tick", TICKS)
def test_firmware_interpolates_between_rates_to_the_tick(tmp_path: Path, tick: str) -> None:
    table, unit = braked(), {"1 ns": 1e-9, "1 us": 1e-6, "5 us": 5e-6}[tick]
    (tmp_path / "table.h").write_text(table.to_header(tick))
    asked = [700_000, 800_000, 800_001, 851_234, 899_999, 950_000, 999_999, 1_000_000, 1_200_000]
    rows = run_c(
        tmp_path,
        f"""
#include "table.h"
#include <stdio.h>
int main(void) {{
  static const uint32_t rate[] = {{{", ".join(map(str, asked))}}};
  for (unsigned i = 0; i < {len(asked)}u; i++) for (unsigned j = 0; j < {PREFIX.upper()}_HISTORIES; j++) {{
    int32_t t[4];
    {PREFIX}_times(rate[i], j, t);
    printf("%ld %ld %ld %ld\\n", (long)t[0], (long)t[1], (long)t[2], (long)t[3]);
  }}
  return 0;
}}
""",
    )
    fired = np.array(rows).reshape(len(asked), -1, 4)
    held = table.quantised(tick)
    for place, millihertz in enumerate(asked):
        exact = np.stack(held.at(min(max(1e-3 * millihertz, 800.0), 1000.0)), axis=1) / unit
        assert abs(fired[place] - exact).max() <= 0.5 + 1e-4


def test_a_dot_is_known_when_its_first_pulse_is_fired(tmp_path: Path) -> None:
    """For every history and rate, against the drive that the table generates for a pattern."""
    table = braked()
    ahead = look_ahead({name: getattr(table, name) for name in COLUMNS}, table.rates, 2, 2)
    for row, rate in enumerate(table.rates.tolist()):
        for history in histories(2, 2):
            number = number_of(history, 2)
            slots = pattern_of(history)
            pulses = pulses_of(table.at(rate), 2, 2, slots, rate)
            begun = [float(pulses.fired[-1])]
            if len(slots) > 1 and pulses.braked[-2] > 0.0:
                begun.append(float(pulses.fired[-2] + pulses.offset[-2]))
            if history[0] != 0:
                slots_before = (float(pulses.due[-1]) - min(begun)) * rate
                assert ahead[row, number] == max(0, math.ceil(slots_before - 1e-6))
        # 0.75 ms after the last dot the two slots after it must be known to be empty.
        assert ahead[row, 0] == math.ceil(2.0 - 750e-6 * rate) == 2
    assert (ahead == table.look_ahead).all()
    (tmp_path / "table.h").write_text(table.to_header())
    text = '#include "table.h"\n#include <stdio.h>\n'
    text += f'int main(void) {{ printf("%u\\n", {PREFIX}_slots_ahead(1u)); return 0; }}\n'
    assert run_c(tmp_path, text) == [[int(ahead[1].max())]]


def test_two_tables_go_into_one_program(tmp_path: Path) -> None:
    tables = [
        braked(),
        braked(serial="7-a"),
        braked(driver="switch"),
        braked(rates=np.array([500.0, 1000.0])),
    ]
    prefixes = [
        PREFIX,
        "printhammer_hendriks_1983_7_a_800_1000hz",
        "printhammer_hendriks_1983_switch_800_1000hz",
    ]
    prefixes.append("printhammer_hendriks_1983_500_1000hz")
    text = "#include <stdio.h>\n"
    for number, table in enumerate(tables):
        (tmp_path / f"{number}.h").write_text(table.to_header())
        text += f'#include "{number}.h"\n'
    calls = "".join(f'printf("%u\\n", (unsigned){prefix.upper()}_HISTORIES);' for prefix in prefixes)
    assert run_c(tmp_path, f"{text}int main(void) {{ {calls} return 0; }}\n") == [[9]] * 4
    assert '"7-a"' in tables[1].to_header()
    assert '_DRIVER "switch"' in tables[2].to_header()


def test_two_different_tables_of_one_name_stop_the_compiler(tmp_path: Path) -> None:
    """The include guard of the first header must not silently skip a second, different table."""
    for number, table in enumerate([braked(), braked(), braked(largest_current=3.0)]):
        (tmp_path / f"{number}.h").write_text(table.to_header())
    for other, compiles in ((1, True), (2, False)):
        (tmp_path / "main.c").write_text(
            f'#include "0.h"\n#include "{other}.h"\nint main(void) {{ return 0; }}\n'
        )
        command = ["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-c", "main.c"]
        done = subprocess.run(command, cwd=tmp_path, check=False, capture_output=True, text=True)
        assert (done.returncode == 0) is compiles, done.stderr
        assert compiles or "two headers with different tables" in done.stderr


def test_the_example_of_the_page_fires_what_python_fires(tmp_path: Path) -> None:
    table = braked()
    (tmp_path / "table.h").write_text(table.to_header("1 us"))
    (text,) = re.findall("```c\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    for name in ("HENDRIKS_1983_100_1665HZ", "hendriks_1983_100_1665hz"):
        text = text.replace(f"printhammer_{name}", PREFIX).replace(f"PRINTHAMMER_{name}", PREFIX.upper())
    rows = np.array(run_c(tmp_path, text))
    slots = [place for place, wanted in enumerate("1101000111") if wanted == "1"]
    pulses = pulses_of(table.quantised("1 us").at(950.0), 2, 2, slots, 950.0)
    on, off = pulses.fired - FIRST_SLOT, pulses.fired - FIRST_SLOT + pulses.width
    brake = pulses.braked > 0.0
    begun = (pulses.fired + pulses.offset)[brake] - FIRST_SLOT
    expected = np.concatenate([np.c_[on, off], np.c_[begun, begun + pulses.braked[brake]]])
    expected = expected[np.argsort(expected[:, 0])] / 1e-6
    assert abs(rows[np.argsort(rows[:, 0])] - expected).max() <= 2.0
