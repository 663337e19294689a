"""The kernel for variational equations: templates of their own, bound to the laws of a plain kernel.

Apart from the plain kernel, so that runs which do not ask for derivatives compile nothing for them; executed
once for derivatives with respect to states and once more, forced, for those with respect to constants.
"""

from __future__ import annotations

import functools
import hashlib

from printhammer.kernel.compile.specialise import Kernel, execute_all, one_at_a_time, source_file
from printhammer.kernel.variational.layout import changing, electric_row

TEMPLATES = ("slopes", "circuit", "forcing", "supply", "columns", "steps", "switches", "flow")


def variational(plain: Kernel, *, forced: bool) -> Kernel:
    """Return the kernel whose entry point `flow` carries columns along the runs of a plain one.

    See :mod:`printhammer.kernel.variational.flow`; `forced` says whether constants force the columns.
    """
    with one_at_a_time:
        return _built(plain, forced)


@functools.cache
def _built(plain: Kernel, forced: bool) -> Kernel:
    sources = hashlib.sha256(repr((plain.digest, forced)).encode())
    sources.update(source_file("variational.layout").read_bytes())
    namespace = {
        **plain.namespace,
        "FORCED": forced,
        "CHANGING": changing(forced, plain.namespace["HAS_DAMPING"], plain.namespace["HAS_CIRCUIT"]),
        "ELECTRIC_ROW": electric_row(forced),
    }
    label = f"{plain.label}, by {'constants' if forced else 'states'}"
    return execute_all([f"variational.{name}" for name in TEMPLATES], namespace, sources, label)
