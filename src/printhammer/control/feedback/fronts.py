"""Maps for packs at several distances, between which those for the distance that is learned are interpolated.

This is gain scheduling, with the distance as its variable. In the pack and on the way out of it only the
distance from its front counts, but magnet and spring depend on the place, and so does the time of a flight
that ends at the backstop.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from printhammer.control.feedback.impact_map import (
    ForceMap,
    ImpactMap,
    force_map,
    impact_map,
    place_of,
    released_forces,
)
from printhammer.control.feedback.plant import Plant
from printhammer.control.feedback.soft_landing import Landing, Launch, soft_landing
from printhammer.support.arrays import FloatArray, IntArray
from printhammer.support.threads import Progress

OFFSETS: Final = (-0.07, 0.0, 0.07)
"""By how much the fronts of the maps lie farther from the armature, in parts of the way to the pack; evenly
spaced."""

STEPS: Final = 100
"""Steps of the work for one distance."""

_MAPPING: Final = 70
"""Of these, until the map of the touches is there."""

MIDDLE: Final = 1  # Number of the nominal one


@dataclass(frozen=True)
class Fronts:
    """Maps for packs at several distances."""

    # From touch to touch, one for each of `OFFSETS`, with the same touches and the same ways
    maps: tuple[ImpactMap, ...]
    landings: tuple[Landing, ...]  # Ways to land, likewise
    # By how much the force grows with the distance of the front where the coil is switched as for the
    # nominal one: in parts of the single-pulse force for one way from backstop to pack, (T, A)
    front_force: FloatArray

    @property
    def table(self) -> ImpactMap:
        """That of the nominal hammer."""
        return self.maps[MIDDLE]

    @property
    def landing(self) -> Landing:
        """That of the nominal hammer."""
        return self.landings[MIDDLE]


def fronts(plant: Plant, forces: ForceMap, start: Launch, progress: Progress | None = None) -> Fronts:
    """Compute the maps for all distances, with the forces of the nominal hammer and its start from rest.

    `progress` is called with what is done in `STEPS` for each of the distances.
    """
    maps: list[ImpactMap] = []
    landings: list[Landing] = []

    def mapping(done: int, total: int) -> None:
        if progress is not None:
            progress(STEPS * len(landings) + int(_MAPPING * done / total), STEPS * len(OFFSETS))

    for offset in OFFSETS:
        moved = plant.moved(offset)
        own = force_map(moved) if offset else forces
        maps.append(impact_map(moved, own, start.width, mapping))
        landings.append(soft_landing(moved, own))
    return Fronts(tuple(maps), tuple(landings), front_force(plant.moved(OFFSETS[-1]), maps[MIDDLE]))


def front_force(farther: Plant, table: ImpactMap) -> FloatArray:
    """Return by how much the force grows with the distance of the front, see `Fronts`.

    `farther` has the farthest front; the map is that of the nominal hammer.
    """
    keys: dict[tuple[int, float, float], int] = {}
    which = np.full(table.release.shape, -1)
    for row, way in zip(*np.nonzero(np.isfinite(table.release)), strict=True):
        key = int(row), float(table.release[row, way]), float(table.back[way])
        which[row, way] = keys.setdefault(key, len(keys))
    # From where the nominal hammer touches its pack.
    forces = released_forces(farther, table.forces, list(keys))
    nominal = np.array([table.forces.force_at(*key) for key in keys])
    slopes = np.append(np.nan_to_num((forces - nominal) / OFFSETS[-1]), 0.0)
    return np.asarray(slopes[which])


def between_fronts(front: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the number of the map below some fronts (M,), and the share of the one above.

    Fronts are given by how much they lie farther away, in parts of the way to the pack; those beyond the last
    map count as there.
    """
    return place_of(np.clip(front, OFFSETS[0], OFFSETS[-1]), np.array(OFFSETS))
