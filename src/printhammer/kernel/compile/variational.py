"""The kernel for sensitivities: templates of its own, bound to the laws of a plain kernel.

Apart from the plain kernel, so that runs which do not ask for sensitivities compile nothing for them.
"""

from __future__ import annotations

import functools
import hashlib
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.specialise import Kernel, execute, one_at_a_time, source_file

if TYPE_CHECKING:
    from types import ModuleType

TEMPLATES = ("variational.influence", "variational.influence_switches", "variational.sensitivity")


def with_sensitivity(plain: Kernel) -> Kernel:
    """Return the kernel whose entry point `sensitivity` goes by the laws of a plain one.

    See :mod:`printhammer.kernel.variational.sensitivity`.
    """
    with one_at_a_time:
        return _built(plain)


@functools.cache
def _built(plain: Kernel) -> Kernel:
    sources = hashlib.sha256(plain.digest.encode())
    for name in TEMPLATES:
        sources.update(source_file(name).read_bytes())
    digest = sources.hexdigest()[:16]
    namespace: dict[str, Any] = {**plain.namespace, "DIGEST": digest}
    modules: dict[str, ModuleType] = {}
    for name in TEMPLATES:
        module = execute(name, digest, namespace)
        modules[name] = module
        namespace.update(
            {
                key: value
                for key, value in vars(module).items()
                if hasattr(value, "py_func") or getattr(value, "__module__", "") == module.__name__
            }
        )
    return Kernel(modules, f"sensitivities of {plain.label}", namespace, digest)
