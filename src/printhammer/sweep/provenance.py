"""Where the results of a sweep come from, and what must agree where it goes on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from printhammer.sweep.spec import Spec


def versions() -> dict[str, str]:
    """Return the versions on which the bits of the results depend."""
    import numba
    import numpy as np
    import scipy

    from printhammer import __version__

    return {
        "printhammer": __version__,
        "numpy": np.__version__,
        "numba": numba.__version__,
        "scipy": scipy.__version__,
    }


def identity(spec: Spec) -> dict[str, str]:
    """Return what must be the same for results to lie in one store; the readable first."""
    import zarr

    from printhammer.sweep.plan import FORMAT

    return {
        "store_format": FORMAT,
        **versions(),
        "zarr": zarr.__version__,
        "hammer": spec.base.hammer.name,
        "hammer_fingerprint": spec.base.hammer.fingerprint,
        "tolerance": repr(spec.base.tolerance),
        "axes": ", ".join(axis.key for axis in spec.axes),
        "spec_fingerprint": spec.fingerprint,
    }


def attributes(spec: Spec) -> dict[str, Any]:
    """Return what a reader of a store may want to know, beside its identity."""
    found: dict[str, Any] = {
        "title": spec.title,
        "hammer_file": spec.base.hammer.to_toml(),
        "spec": spec.text,
        "design": spec.design,
    }
    if not spec.grid:
        found["seed"] = spec.seed
    return found
