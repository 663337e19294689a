"""Multipliers of histories in the C header, against two simulated rows, one of them perturbed."""

import json
from dataclasses import replace
from itertools import accumulate, cycle, islice
from pathlib import Path

import numpy as np
import pytest
from tests.control.table.by_hand import by_hand
from tests.control.table.test_header import run_c
from tests.errors import refused

import printhammer as ph
from printhammer.control.table.compensation import CompensationTable, load_table
from printhammer.control.table.drive import histories, history_text, number_of
from printhammer.control.table.header import thousandths
from printhammer.control.table.multipliers import repetition, with_multipliers

RATE = 1300.0
PREFIX = "printhammer_hendriks_1983_1300hz"
DISTURBED = 12  # Index of the firing that is late in the second row
LATE = 5e-9  # s


@pytest.fixture(scope="module")
def table() -> CompensationTable:
    return ph.tune(ph.load("hendriks-1983"), rate=RATE)


def growth(table: CompensationTable, gaps: tuple[int, ...]) -> float:
    """Return the multiplier over a repetition of gaps, from the difference of two simulated rows.

    If the differences at successive repetitions are parallel, their ratio is the larger multiplier. Else they
    obey d[j + 2] = a d[j + 1] + b d[j], the characteristic equation of a map of two unknowns, whose roots are
    the multipliers.
    """
    hammer, size = ph.load("hendriks-1983"), len(gaps)
    dots = DISTURBED + 5 * size + 2
    slots = tuple(accumulate(islice(cycle(gaps), dots - 1), initial=0))
    drive = table.strategy(hammer)(hammer, [slots], RATE)[0]
    late = drive.times.copy()
    late[DISTURBED] += LATE
    seen = drive.times[DISTURBED + 1 :: size][:4]
    rows = [
        ph.simulate(
            hammer, ph.PulseSequence(list(drive.waveforms), at=at.tolist()), times=seen, tolerance=1e-12
        )
        for at in (drive.times, late)
    ]
    apart = np.array([rows[1].x - rows[0].x, (rows[1].v - rows[0].v) / RATE]).T
    _, first, second, _ = apart
    along, across = first @ second / (first @ first), first[0] * second[1] - first[1] * second[0]
    if abs(across) < 1e-3 * np.linalg.norm(first) * np.linalg.norm(second):
        return float(along)
    known = np.concatenate([apart[1:3], apart[:2]], axis=1).reshape(2, 2, 2).transpose(0, 2, 1).reshape(-1, 2)
    (a, b), *_ = np.linalg.lstsq(known, apart[2:].ravel(), rcond=None)
    roots = np.roots([1.0, -a, -b])
    largest = roots[np.abs(roots).argmax()]
    return float(largest.real if abs(largest.imag) < 1e-9 else abs(largest))


def test_the_header_states_what_two_rows_show(tmp_path: Path, table: CompensationTable) -> None:
    (tmp_path / "table.h").write_text(table.to_header())
    every = histories(2, 2)
    numbers = [number_of(history, 2) for history in every]
    prints = "".join(f'printf("%d\\n", {PREFIX}_multiplier[0][{number}]);' for number in numbers)
    text = '#include "table.h"\n#include <stdio.h>\n'
    text += f'int main(void) {{ {prints} printf("%d\\n", {PREFIX}_largest_multiplier(0u)); return 0; }}\n'
    *stated, largest = (row[0] for row in run_c(tmp_path, text))
    assert largest == max(map(abs, stated))
    seen = {}
    for history, thousandth in zip(every, stated, strict=True):
        # The gaps in chronological order; a rest is three slots.
        gaps = tuple(gap or 3 for gap in reversed(history))
        gaps = gaps[:1] if len(set(gaps)) == 1 else gaps
        seen[history] = growth(table, gaps)
        m = 1e-3 * thousandth
        assert np.sign(m) * abs(m) ** len(gaps) == pytest.approx(seen[history], abs=3e-3), history_text(
            history
        )
    # One history alternates and one does not; neither is close to 0.
    assert min(seen.values()) < -0.3 < 0.3 < max(seen.values())


def test_a_table_in_ticks_has_multipliers_of_its_own(table: CompensationTable) -> None:
    hammer = ph.load("hendriks-1983")
    assert np.array_equal(table.quantised("1 ns").multiplier, table.multiplier)
    whole = table.quantised("5 us")
    assert np.isnan(whole.multiplier).all()
    whole = with_multipliers(whole, hammer)
    assert whole.quantised("5 us").multiplier == pytest.approx(whole.multiplier)
    place = number_of((2, 2), 2)
    assert whole.multiplier[0, place] == pytest.approx(growth(whole, (2,)), abs=1e-3)
    assert abs(whole.multiplier[0, place] - table.multiplier[0, place]) > 0.1


def test_the_pattern_of_a_history_contains_it() -> None:
    for gaps, reach in ((1, 3), (2, 2), (3, 2), (4, 2)):
        for history in histories(gaps, reach):
            pattern = repetition(history, reach)
            row = [*pattern] * (2 * gaps)
            windows = {
                tuple(0 if gap > reach else gap for gap in row[k : k + gaps][::-1]) for k in range(gaps)
            }
            assert history in {
                tuple(gap if 0 not in window[: at + 1] else 0 for at, gap in enumerate(window))
                for window in windows
            }
            assert pattern == min(pattern[k:] + pattern[:k] for k in range(len(pattern)))


def test_the_summary_names_rows_in_which_an_error_grows() -> None:
    table = by_hand()
    values = np.full_like(table.multiplier, 0.5)
    assert "grows" not in str(replace(table, multiplier=values).summary())
    assert "grows" not in str(replace(table, multiplier=np.full_like(values, np.nan)).summary())
    values[1, number_of((1, 2), 2)] = -1.001
    values[:, number_of((1, 1), 2)] = np.nan
    said = str(replace(table, multiplier=values).summary())
    assert "the gaps 1-1 at 800 Hz and 1 other rate, 1-2 at 1000 Hz, an error grows" in " ".join(said.split())


def test_thousandths_are_on_the_safe_side_of_1() -> None:
    values = np.array([1.0, -1.0, 1.0001, -1.0001, 0.9995, 0.0, 40.0, -40.0, np.nan, np.inf])
    assert thousandths(values).tolist() == [
        1000, -1000, 1001, -1001, 1000, 0, 32767, -32767, 32767, 32767,
    ]  # fmt: skip


@pytest.mark.parametrize("suffix", [".csv", ".json"])
def test_a_file_without_multipliers_is_read(tmp_path: Path, suffix: str) -> None:
    table, path = by_hand(), tmp_path / f"table{suffix}"
    table.save(path)
    if suffix == ".csv":
        lines = path.read_text().splitlines()
        path.write_text("\n".join(line if line[0] == "#" else line.rpartition(",")[0] for line in lines))
    else:
        content = json.loads(path.read_text())
        del content["columns"]["multiplier"]
        path.write_text(json.dumps(content))
    read = load_table(path)
    assert np.isnan(read.multiplier).all()
    assert np.array_equal(read.deviation, table.deviation, equal_nan=True)
    path.write_text(path.read_text().replace("deviation", "deviance"))
    with refused("columns" if suffix == ".csv" else "deviance"):
        load_table(path)
