"""Figure of the family."""

from __future__ import annotations

from typing import TYPE_CHECKING

from printhammer.errors import InputError
from printhammer.report.reconstruction.results import Results, shipped_results
from studies.reconstruction.family.choice import at_gauge
from studies.reconstruction.family.family import family_table, print_forces
from studies.reconstruction.family.robustness import robustness

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from printhammer.hammer.hammer import Hammer


def family_picture(hammer: Hammer, results: Results | None = None) -> Figure:
    """Draw the constants of the family relative to those of a hammer, and the conclusions of the family.

    See `studies.reconstruction.figures.family`.

    Parameters
    ----------
    hammer : Hammer
        The reference hammer, whose constants are drawn as 1, usually the shipped one. This hammer is first
        scaled to the print force and the current of the family, which does not change its motion.
    results : Results, optional
        Results that contain the table of the family; by default those shipped with the program.

    Raises
    ------
    InputError
        There is no table of a family, the hammer does not print, or it lacks a constant of the table.
    """
    from studies.reconstruction.figures.family import family

    table = family_table(shipped_results() if results is None else results)
    known = {key: constant.si for key, constant in hammer.constants.items()}
    keys = list(table.hammers[0].constants)
    missing = [key for key in keys if key not in known]
    if missing:
        raise InputError(
            f"{hammer.path}: the key {missing[0]!r} is missing, expected a hammer like the family"
        )
    (force,) = print_forces([hammer]).tolist()
    if not force > 0.0:
        raise InputError(f"{hammer.path}: the hammer does not print, expected one like those of the family")
    units = {key: constant.si_unit for key, constant in hammer.constants.items()}
    own = at_gauge({key: known[key] for key in keys}, units, force)
    members = [
        at_gauge(row.constants, units, float(row.conclusions["print_force_N"] or force))
        for row in table.hammers
    ]
    conclusions = [row.conclusions for row in table.hammers]
    held = robustness(conclusions, members)
    shown = {name: entry for name, entry in held.items() if entry["kind"] == "quantity"}
    return family(hammer, [own, *members], conclusions, shown)
