"""The family: clearly different hammers that reproduce the claims of the paper about equally well.

The constants of the hammer of 1983 are not determined uniquely. From the log of a search, pairwise clearly
different hammers are selected and judged by the claims, and their conclusions are computed. A conclusion
on which all members agree does not depend on the constants that the paper did not print.
"""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.claims import Context
from printhammer.claims.context import NotMeasurableError
from printhammer.claims.judging import claims, judge
from printhammer.drive.trains import PulseTrain
from printhammer.errors import InputError
from printhammer.report.reconstruction.results import (
    Conclusion,
    Family,
    FamilyMember,
    Results,
    shipped_results,
)
from printhammer.run.ensemble import Ensemble
from printhammer.support.files import make_folder, write_file
from studies.reconstruction.family.choice import at_gauge, choose
from studies.reconstruction.family.conclusions import conclude
from studies.reconstruction.family.log import LEAST_PANELS, Logged, read_logs
from studies.reconstruction.family.robustness import robustness
from studies.reconstruction.family.shelf import Shelf
from studies.reconstruction.judging.judged import FIGURE_11, STATED
from studies.reconstruction.search.space import hammer_of, template

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

LEAST: Final = 20  # Smallest number of hammers of a family

COUNT: Final = 24  # Default number of hammers of the family

WRITTEN: Final = ("family.csv", "family.json")
"""Names of the files to which a family is written."""

FORMAT: Final = 1

_PRINTED: Final = 2e-3
_CELL: Final = 0.02
_MOST: Final = 2000


def family_hammers(folder: str | Path | None = None) -> list[Hammer]:
    """Return the hammers of the family; the status of each constant is "reconstructed".

    The hammers are in the order of the table, named "hendriks-1983-family-01" and so on, and are read from
    the `family.json` in a folder or, without a folder, from the file shipped with the program.

    Raises
    ------
    InputError
        There is no table of the family, or its file is invalid.
    """
    results = shipped_results() if folder is None else Results(Path(folder))
    table = family_table(results)
    return [
        hammer_of(
            row.constants,
            name=f"hendriks-1983-{row.name}",
            title=f"The stored-energy print hammer of Hendriks (1983), {row.name} of its reconstructions",
        )
        for row in table.hammers
    ]


def family_table(results: Results) -> Family:
    """Return the table of the family.

    Raises
    ------
    InputError
        There is no table of the family, or its file is invalid.
    """
    table = results.family
    if table is None:
        raise InputError(f"{results.folder}: expected the file family.json of a family of hammers")
    return table


def write_family(
    logs: Iterable[str | Path],
    folder: str | Path,
    progress: Callable[[str], None] | None = None,
    *,
    count: int = COUNT,
    least: int = LEAST,
) -> list[FamilyMember]:
    """Select a family from logs of judged candidates, judge it, and write `family.json` and `family.csv`.

    Verdicts and conclusions are kept in `family.part.jsonl` in the folder until the family is complete, so
    that an interrupted run can be resumed.

    Parameters
    ----------
    logs : iterable of path
        See `studies.reconstruction.family.log`.
    folder : path
        Output folder; created if it is missing, after the logs have been read.
    progress : callable, optional
        Called with a line of text at each step.
    count : int, optional
        Largest number of members.
    least : int, optional
        Smallest number of members.

    Raises
    ------
    InputError
        A log is invalid, a logged hammer cannot be built, the logs contain too few clearly different hammers,
        or a file cannot be written.
    """
    tell = progress or (lambda _: None)
    paths = list(logs)
    logged = read_logs(paths)
    candidates = promising(logged)
    tell(f"{len(logged)} hammers in the logs, {len(candidates)} of them promising")
    hammers = [hammer_of(row.constants) for row in candidates]
    forces = print_forces(hammers)
    printing = np.flatnonzero(np.isfinite(forces)).tolist()
    candidates, hammers = [candidates[i] for i in printing], [hammers[i] for i in printing]
    if not candidates:
        raise InputError(_too_few(paths, 0, least))
    tables = compared([row.constants for row in candidates], forces[printing].tolist())
    place = make_folder(folder)
    shelf = Shelf(place / "family.part.jsonl")
    members: dict[int, FamilyMember] = {}

    def accept(number: int) -> bool:
        member = _judged(candidates[number], hammers[number], shelf)
        tell(f"{candidates[number].source}: {_described(member)}")
        if member is not None:
            members[number] = member
        return member is not None

    chosen = choose(tables, count, accept)
    if len(chosen) < least:
        tell(f"{len(chosen)} hammers far from each other; now as many as there are")
        chosen = max(chosen, choose(tables, count, accept, wide=False), key=len)
    if len(chosen) < least:
        raise InputError(_too_few(paths, len(chosen), least))
    family = [
        members[number].model_copy(update={"name": f"family-{place:02d}"})
        for place, number in enumerate(chosen, 1)
    ]
    rows = [
        dict(zip(_keys([row.constants for row in candidates]), tables[1][number], strict=True))
        for number in chosen
    ]
    for name, text in zip(WRITTEN, (csv_text(family), json_text(family, rows)), strict=True):
        write_file(place / name, text)
    shelf.remove()
    return family


def _too_few(paths: Sequence[str | Path], count: int, least: int) -> str:
    names = ", ".join(str(path) for path in paths)
    return f"{names}: {count} clearly different hammers are in the logs, expected {least}"


def promising(logged: Sequence[Logged], most: int = _MOST) -> list[Logged]:
    """Return the logged hammers that satisfy all stated claims judged so far, the best first.

    If there are more than `most`, hammers in the same cell of a logarithmic lattice of constants count once.
    """
    rows = sorted(
        (row for row in logged if row.promising),
        key=lambda row: (-(row.panels or 0), -sum(row.verdicts.values())),
    )
    cell = _CELL
    while len(rows) > most:
        cells: dict[tuple[tuple[str, float, int], ...], Logged] = {}
        for row in rows:
            cells.setdefault(_cell(row.constants, cell), row)
        rows, cell = list(cells.values()), 1.5 * cell
    return rows


def _cell(constants: Mapping[str, float], width: float) -> tuple[tuple[str, float, int], ...]:
    """Return the indices of the cell of a logarithmic lattice that contains the constants."""
    return tuple(
        (key, float(np.sign(value)), round(float(np.log(abs(value))) / width) if value else 0)
        for key, value in sorted(constants.items())
    )


def print_forces(hammers: Sequence[Hammer]) -> FloatArray:
    """Return the peak force of each hammer's single-pulse dot, N; NaN for a hammer that does not print."""
    able = [i for i, hammer in enumerate(hammers) if hammer.waveform is not None]
    forces = np.full(len(hammers), np.nan)
    if able:
        drives = [PulseTrain(waveform) for i in able if (waveform := hammers[i].waveform) is not None]
        dots = Ensemble([hammers[i] for i in able], drives, _PRINTED).run(dots=True).dots
        assert dots is not None
        forces[able] = dots.peak_force[:, 0]
    return forces


def compared(constants: Sequence[Mapping[str, float]], forces: Sequence[float]) -> list[FloatArray]:
    """Return the constants of hammers, unscaled and scaled to the common gauge, each of shape (n, k).

    A constant that a hammer lacks is taken from the shipped hammer; `forces` are the peak forces [N] of the
    dots of a single pulse.
    """
    keys = _keys(constants)
    units = {key: constant.si_unit for key, constant in template().constants.items()}
    plain = [{key: row.get(key, template().constants[key].si) for key in keys} for row in constants]
    gauged = [at_gauge(row, units, force) for row, force in zip(plain, forces, strict=True)]
    return [
        np.array([[row[key] for key in keys] for row in rows]).reshape(len(rows), -1)
        for rows in (plain, gauged)
    ]


def _keys(constants: Sequence[Mapping[str, float]]) -> list[str]:
    """Return the keys of the constants of any hammer, and the amplitude, in the order of the hammer file."""
    named = {key for row in constants for key in row} | {"waveform.amplitude"}
    return [key for key in template().constants if key in named]


def _judged(row: Logged, hammer: Hammer, shelf: Shelf) -> FamilyMember | None:
    """Return a logged hammer as an unnamed member of the family; None if the hammer does not qualify.

    Claims of kind "stated" are judged again; the verdicts on other claims are those of the log.
    """
    known = shelf.get(hammer)
    if known is None:
        known = _judge(hammer)
        shelf.put(hammer, known)
    if not known["member"]:
        return None
    logged = {name: "holds" if holds else "fails" for name, holds in row.verdicts.items()}
    verdicts = {**logged, **known["verdicts"]}
    return FamilyMember(
        name="",
        constants=dict(row.constants),
        verdicts={name: verdicts[name] for name in claims() if name in verdicts},
        panels=known["panels"],
        conclusions=known["conclusions"],
    )


def _judge(hammer: Hammer) -> dict[str, Any]:
    """Judge the stated claims, the slowest last, and compute the conclusions if they hold."""
    context = Context(hammer)
    verdicts: dict[str, str] = {}
    judged: dict[str, Any] = {"member": False, "verdicts": verdicts, "panels": 0, "conclusions": {}}
    for name in STATED:
        verdicts[name] = judge(context, claims()[name]).verdict
        if verdicts[name] != "holds":
            return judged
    result = judge(context, claims()[FIGURE_11])
    verdicts[FIGURE_11] = result.verdict
    judged["panels"] = result.value["panels_as_printed"] if result.value is not None else 0
    if judged["panels"] < LEAST_PANELS:
        return judged
    try:
        judged["conclusions"] = conclude(hammer, context).as_dict()
    except NotMeasurableError:
        return judged
    judged["member"] = True
    return judged


def _described(member: FamilyMember | None) -> str:
    if member is None:
        return "no member"
    rate, onset = member.conclusions["safe_rate_Hz"], member.conclusions["chaos_onset_s"]
    safe = f"safe up to {rate:.0f} Hz" if rate is not None else "not safe at any rate"
    strange = f"strange from {onset * 1e3:.3f} ms" if onset is not None else "never strange"
    return f"a member, {member.panels} panels of Fig. 11 as printed, {safe}, {strange}"


def json_text(family: Sequence[FamilyMember], gauged: Sequence[Mapping[str, float]]) -> str:
    """Return the text of `family.json`; see `printhammer.report.reconstruction.results.Family`.

    `gauged` maps the keys of the constants to the values of the members, SI, scaled to the common gauge.
    """
    hammers = ",\n".join(f"  {_table(member.model_dump(), 3)}" for member in family)
    held = robustness([member.conclusions for member in family], gauged)
    conclusions = _table(
        {name: {key: row[key] for key in Conclusion.model_fields} for name, row in held.items()}, 2
    )
    return f'{{\n "format": {FORMAT},\n "hammers": [\n{hammers}\n ],\n "conclusions": {conclusions}\n}}\n'


def _table(table: Mapping[str, Any], indent: int) -> str:
    """Return the JSON text of a table with one entry per line."""
    lines = (
        f"{' ' * indent}{json.dumps(key)}: {json.dumps(entry, allow_nan=False)}"
        for key, entry in table.items()
    )
    return "{\n" + ",\n".join(lines) + f"\n{' ' * (indent - 1)}}}"


def csv_text(family: Sequence[FamilyMember]) -> str:
    """Return the text of `family.csv`: one row per member, constants and conclusions with their units."""
    units = {key: constant.si_unit for key, constant in template().constants.items()}
    keys = _keys([member.constants for member in family])
    judged = [name for name in claims() if any(name in member.verdicts for member in family)]
    conclusions = list(family[0].conclusions)
    heading = [
        "name",
        *(f"{key} [{units[key]}]" for key in keys),
        "panels of Fig. 11 as printed [1]",
        *(f"{name.rpartition('_')[0].replace('_', ' ')} [{name.rpartition('_')[2]}]" for name in conclusions),
        *(f"claim {name}" for name in judged),
    ]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(heading)
    for member in family:
        writer.writerow(
            [
                member.name,
                *(repr(member.constants[key]) if key in member.constants else "" for key in keys),
                member.panels,
                *("" if (value := member.conclusions[name]) is None else repr(value) for name in conclusions),
                *(member.verdicts.get(name, "") for name in judged),
            ]
        )
    return text.getvalue()
