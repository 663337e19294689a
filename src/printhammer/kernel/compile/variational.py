"""The kernel for variational equations: templates of their own, bound to the laws of a plain kernel.

Apart from the plain kernel, so that runs which do not ask for derivatives compile nothing for them; executed
once for derivatives with respect to states and once more, forced, for those with respect to constants.
"""

from __future__ import annotations

import functools

from printhammer.kernel.compile.bindings import bindings_of
from printhammer.kernel.compile.modules import Entry, one_at_a_time
from printhammer.kernel.compile.specialise import Kernel, is_interpreted
from printhammer.kernel.compile.templates import VARIATIONAL, execute_all
from printhammer.kernel.variational.layout import changing, electric_row


def variational(plain: Kernel, *, forced: bool) -> Kernel:
    """Return the kernel whose entry point `flow` carries columns along the runs of a plain one.

    See :mod:`printhammer.kernel.variational.flow`; `forced` says whether constants force the columns.
    """
    with one_at_a_time:
        return _built(plain, forced)


@functools.cache
def _built(plain: Kernel, forced: bool) -> Kernel:
    bindings = bindings_of(plain.laws)
    circuit, damped = bindings.choices["HAS_CIRCUIT"], bindings.choices["HAS_DAMPING"]
    choices = {"CHANGING": changing(forced, damped, circuit)}
    variant = {"HAS_CIRCUIT": circuit, "FORCED": forced}
    label = f"{plain.label}, by {'constants' if forced else 'states'}"
    kernel = Kernel(plain.laws, label, [Entry("flow", variant, bindings, choices, label)])
    if is_interpreted():
        own = {**choices, "FORCED": forced, "ELECTRIC_ROW": electric_row(forced)}
        kernel.interpret(execute_all(VARIATIONAL, {**plain.namespace, **own}, f"{id(kernel):x}"))
    return kernel
