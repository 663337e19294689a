"""C headers in ticks of a timer: they compile without a warning, and agree with Python to the tick."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.control.table.by_hand import by_hand
from tests.errors import refused

from printhammer.control.table.drive import COLUMNS

TICKS = ("1 ns", "1 us", "5 us")


@pytest.mark.parametrize("tick", TICKS)
def test_a_driver_in_c_agrees_to_the_tick(tmp_path: Path, tick: str) -> None:
    table = by_hand()
    (tmp_path / "table.h").write_text(table.to_header(tick))
    name = "printhammer_" + "".join(letter if letter.isalnum() else "_" for letter in table.hammer)
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
    lines += [f"  size += sizeof {name}_{column};" for column in COLUMNS]
    lines += [
        f"  unsigned gaps[{table.gaps}] = {{0}};",
        f'  printf("%lu %u %u\\n", (unsigned long)size, {name.upper()}_BYTES, {name}_history(gaps));',
        "  return 0;",
        "}",
    ]
    (tmp_path / "main.c").write_text("\n".join(lines) + "\n")
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror"]
    subprocess.run(["cc", *flags, "-o", "main", "main.c"], cwd=tmp_path, check=True)
    said = subprocess.run([tmp_path / "main"], check=True, capture_output=True, text=True).stdout
    *rows, last = [[int(word) for word in line.split()] for line in said.splitlines()]
    unit = {"1 ns": 1e-9, "1 us": 1e-6, "5 us": 5e-6}[tick]
    wanted = np.stack([np.rint(getattr(table, column) / unit) for column in COLUMNS], axis=2)
    assert np.array_equal(np.array(rows).reshape(rates, entries, 4), wanted)
    assert last == [table.size(tick), table.size(tick), 0]
    exact = table.quantised(tick)
    for column, values in zip(COLUMNS, np.moveaxis(wanted, 2, 0), strict=True):
        assert getattr(exact, column) == pytest.approx(values * unit, abs=1e-15)


def test_short_times_take_half_the_bytes() -> None:
    table = by_hand()
    rates = 4 * table.rates.size
    assert table.size("1 us") - rates == (table.size() - rates) // 2
    assert "int16_t" in table.to_header("1 us")
    assert "TICK_NS 5000" in table.to_header("5 us")
    assert "int16_t" not in table.to_header()


def test_a_budget_and_a_tick_are_kept_to() -> None:
    table = by_hand()
    assert table.to_header("1 us", budget=table.size("1 us"))
    with refused("budget"):
        table.to_header("1 us", budget=10)
    for tick in ("0.5 ns", 1.5e-9, "-1 us"):
        with refused("tick"):
            table.size(tick)
