"""Record of a run: nodes, i.e. the states at the ends of all steps, and contacts.

A node is ``[time, position, velocity, mode, memory]``. Mode and memory are valid from this node to the next;
the memory is the displacement at the latest local maximum in the pack, w = sqrt(b - x) in backstop contact,
and zero elsewhere. With a coil circuit, the electric state and the path of the coil current follow, see
`printhammer.kernel.model.circuit`. A contact is ``[surface, time in, velocity in, time out, velocity out,
index of the last node before the contact, open at the start]``; the time out of a contact that is still open
at the end of the run is NaN.

The caller allocates the arrays. If an array is too short, further rows overwrite its last row but are still
counted: a caller that needs all rows repeats the run with longer arrays, and a caller that needs only the
final state passes an array of one row.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from printhammer.kernel.compile.compiling import compiled
from printhammer.kernel.model.layout import ELECTRIC
from printhammer.kernel.model.modes import FREE

Rows = Any


@compiled
def add_node(nodes: Rows, used: int, t: float, x: float, v: float, mode: int, memory: float) -> int:
    """Write a node to row `used`, or to the last row if the array is full; return the number of nodes."""
    i = min(used, nodes.shape[0] - 1)
    nodes[i, 0] = t
    nodes[i, 1] = x
    nodes[i, 2] = v
    nodes[i, 3] = mode
    nodes[i, 4] = memory
    return used + 1


@compiled
def note_circuit(nodes: Rows, used: int, electric: Any, path: float) -> None:
    """Write the electric state and the conduction path of the coil current to the latest node."""
    i = min(used, nodes.shape[0]) - 1
    for j in range(3):
        nodes[i, ELECTRIC + j] = electric[j]
    nodes[i, ELECTRIC + 3] = path


@compiled
def relabel_node(nodes: Rows, used: int, mode: int) -> None:
    """Change the mode of the latest node, i.e. the mode from this node to the next."""
    nodes[min(used, nodes.shape[0]) - 1, 3] = mode


@compiled
def renew_node(nodes: Rows, used: int, mode: int, memory: float) -> None:
    """Change mode and memory of the latest node, valid from this node to the next."""
    relabel_node(nodes, used, mode)
    nodes[min(used, nodes.shape[0]) - 1, 4] = memory


@compiled
def open_contact(
    contacts: Rows, used: int, surface: int, t: float, v: float, node: int, initial: bool
) -> int:
    """Record the start of a contact at time `t` with velocity `v`; return the number of recorded contacts."""
    i = min(used, contacts.shape[0] - 1)
    contacts[i, 0] = surface
    contacts[i, 1] = t
    contacts[i, 2] = v
    contacts[i, 3] = np.nan
    contacts[i, 4] = np.nan
    contacts[i, 5] = node
    contacts[i, 6] = 1.0 if initial else 0.0
    return used + 1


@compiled
def close_contact(contacts: Rows, used: int, t: float, v: float) -> None:
    """Record the end of the latest contact at time `t` with velocity `v`."""
    i = min(used, contacts.shape[0]) - 1
    contacts[i, 3] = t
    contacts[i, 4] = v


@compiled
def carry_contact(contacts: Rows, mode: int) -> int:
    """Keep a contact that is open after a pause as row 0 of `contacts`; return the number of contacts.

    The number is 0 in the mode FREE, and 1 otherwise.
    """
    if mode == FREE:
        return 0
    contacts[0, 5] = -1.0
    return 1
