"""Tables for packs at several distances, between which those for the distance that is learned lie.

In the pack and on the way out of it only the distance from its front counts, but magnet and spring depend on
the place, and so does the time of a flight that ends at the backstop.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.feedback.bounded import BoundedSequence
from printhammer.control.feedback.impact_map import AHEAD, first_pulse, force_map, swing_table
from printhammer.control.feedback.soft_landing import landing
from printhammer.printing.rates.perturbation import Perturbation, perturbed
from printhammer.run.ensemble import DISPLAY_TOLERANCE, Ensemble

if TYPE_CHECKING:
    from printhammer.control.feedback.driver import Driver
    from printhammer.control.feedback.impact_map import ForceMap, IntArray, SwingTable
    from printhammer.control.feedback.launch import Launch
    from printhammer.control.feedback.soft_landing import Landing
    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.dots.nominal import Nominal
    from printhammer.support.arrays import FloatArray

OFFSETS: Final = (-0.07, 0.0, 0.07)
"""By how much the fronts of the tables lie farther from the armature, in parts of the way to the pack; evenly
spaced."""

MIDDLE: Final = 1
"""Number of the nominal one."""


@dataclass(frozen=True)
class Fronts:
    """Tables for packs at several distances.

    Attributes
    ----------
    tables : tuple of SwingTable
        From touch to touch, one for each of `OFFSETS`, with the same touches and the same ways.
    landings : tuple of Landing
        Ways to land, likewise.
    front_force : array, shape (T, A)
        By how much the force grows with the distance of the front where the coil is switched as for the
        nominal one: in parts of the single-pulse force for one way from backstop to pack.
    """

    tables: tuple[SwingTable, ...]
    landings: tuple[Landing, ...]
    front_force: FloatArray

    @property
    def table(self) -> SwingTable:
        """That of the nominal hammer."""
        return self.tables[MIDDLE]

    @property
    def landing(self) -> Landing:
        """That of the nominal hammer."""
        return self.landings[MIDDLE]


def fronts(
    hammer: Hammer,
    driver: Driver,
    single: Nominal,
    forces: ForceMap,
    start: Launch,
    *,
    threads: int | None = None,
) -> Fronts:
    """Compute the tables for all distances.

    Parameters
    ----------
    hammer : Hammer
        The nominal hammer.
    driver : Driver
        Of its coil.
    single : Nominal
        Its single-pulse dot.
    forces : ForceMap
        Its forces.
    start : Launch
        Its start from rest.
    threads : int, optional
        By default as many as there are cores.
    """
    assert hammer.front is not None
    tables, landings = [], []
    stroke = hammer.front - hammer.origin
    hammers = [
        perturbed(hammer, Perturbation(travel=offset * stroke)) if offset else hammer for offset in OFFSETS
    ]
    for offset, other in zip(OFFSETS, hammers, strict=True):
        own = force_map(other, driver, single, threads=threads) if offset else forces
        tables.append(swing_table(other, driver, single, own, start.width, threads=threads))
        landings.append(landing(other, driver, single, own, threads=threads))
    slopes = front_force(hammers[-1], tables[MIDDLE], single, threads=threads)
    return Fronts(tuple(tables), tuple(landings), slopes)


def front_force(
    farther: Hammer, table: SwingTable, single: Nominal, *, threads: int | None = None
) -> FloatArray:
    """Return by how much the force grows with the distance of the front, see `Fronts`.

    Parameters
    ----------
    farther : Hammer
        The hammer with the farthest front.
    table : SwingTable
        That of the nominal hammer.
    single : Nominal
        Its single-pulse dot.
    threads : int, optional
        By default as many as there are cores.
    """
    forces, long = table.force_map, 3.0 * single.flight_time
    keys: dict[tuple[int, float, float], int] = {}
    which = np.full(table.release.shape, -1)
    for row, way in zip(*np.nonzero(np.isfinite(table.release)), strict=True):
        key = int(row), float(table.release[row, way]), float(table.back[way])
        which[row, way] = keys.setdefault(key, len(keys))
    drives, states = [], []
    for row, release, back in keys:
        first = first_pulse(int(table.kind[row]), release, back, long, table.driver)
        drives.append(BoundedSequence([first], [0.0], table.driver.current))
        states.append((forces.front - AHEAD * table.speed[row], table.speed[row]))
    result = Ensemble(farther, drives, long, states=np.array(states), tolerance=DISPLAY_TOLERANCE).run(
        dots=True, threads=threads
    )
    assert result.dots is not None
    found = np.where(result.ok, result.dots.peak_force[:, 0], np.nan) / single.force
    nominal = np.array([forces.force_at(*key) for key in keys])
    slopes = np.append(np.nan_to_num((found - nominal) / OFFSETS[-1]), 0.0)
    values: FloatArray = slopes[which]
    return values


def between_fronts(front: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the number of the table below some fronts, and the share of the one above.

    Parameters
    ----------
    front : array, shape (M,)
        By how much they lie farther away, in parts of the way to the pack; those beyond the last table count
        as there.
    """
    place = (np.clip(front, OFFSETS[0], OFFSETS[-1]) - OFFSETS[0]) / (OFFSETS[1] - OFFSETS[0])
    below = np.clip(place.astype(np.int64), 0, len(OFFSETS) - 2)
    return below, place - below
