"""Largest indentation and peak force of each pack contact of a run; backstop contacts are skipped.

If the pack law has memory, the integrator ends a step where the armature turns back, so that the indentation
is largest at a node. Only other packs need the search of :func:`printhammer.kernel.single.resample.peaks`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.kernel.model.layout import FRONT, Train
from printhammer.kernel.model.modes import LOADING, PACK_SURFACE

if TYPE_CHECKING:
    from printhammer.kernel.model.forces import pack_force
    from printhammer.kernel.model.laws import MEMORY
    from printhammer.kernel.single.resample import peaks_of


def write_pack_peaks(contacts: Any, nodes: Any, train: Any, hammer: Any, out: Any) -> None:
    """Write the peaks of m contacts to `out`, shape (m, 3).

    A row holds the time of the largest indentation [s], this indentation [m] and the peak force [N]; for a
    backstop contact, the touch time and two zeros. Arguments as for
    :func:`printhammer.kernel.single.resample.peaks`.
    """
    named = Train(*train)
    for row in range(contacts.shape[0]):
        contact = contacts[row]
        out[row, 0], out[row, 1], out[row, 2] = contact[1], 0.0, 0.0
        if int(contact[0]) != PACK_SURFACE:
            continue
        if MEMORY:
            first = int(contact[5])
            highest = first
            i = first
            while i + 1 < nodes.shape[0] and not nodes[i, 0] >= contact[3]:
                i += 1
                if nodes[i, 1] > nodes[highest, 1]:
                    highest = i
            out[row, 0], out[row, 1] = nodes[highest, 0], nodes[highest, 1] - hammer[FRONT]
            out[row, 2] = -pack_force(nodes[highest, 1], 0.0, LOADING, 0.0, hammer)
        else:
            out[row, 0], out[row, 1], out[row, 2] = peaks_of(contact, nodes, named, hammer)
