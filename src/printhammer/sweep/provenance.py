"""Where the results of a sweep come from, and what must agree where it goes on."""

from __future__ import annotations

from importlib.metadata import version
from typing import TYPE_CHECKING, Any, Final

from printhammer.results.provenance import provenance

if TYPE_CHECKING:
    from printhammer.sweep.spec import Spec

FORMAT: Final = "1"
"""Version of the layout of stores."""


def identity(spec: Spec) -> dict[str, str]:
    """Return what must be the same for results to lie in one store; the readable first."""
    return {
        "store_format": FORMAT,
        **provenance(hammer=spec.base.hammer, tolerance=spec.base.tolerance),
        "zarr": version("zarr"),
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
