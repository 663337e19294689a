"""The kernel for lanes: the same templates once more, bound to laws without branches or calls.

The force sum and the steps are those of the plain kernel, executed with :mod:`printhammer.kernel.lanes.math`
in the place of :mod:`math`, the drive in closed form, the constants of a hammer as a tuple, and everything
inlined; what looks after switches is scalar and uses the plain kernel.
"""

from __future__ import annotations

import functools
import hashlib
from types import FunctionType, ModuleType
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import all_inlined, inlined
from printhammer.kernel.compile.specialise import (
    Kernel,
    execute,
    law_bindings,
    one_at_a_time,
    source_file,
    specialise,
)
from printhammer.kernel.lanes import layout as lane_layout
from printhammer.kernel.lanes import math as lane_math

if TYPE_CHECKING:
    from printhammer.kernel.model.laws import Laws

_SOURCES = (
    "lanes.layout",
    "lanes.math",
    "lanes.drive",
    "lanes.steps",
    "lanes.events",
    "lanes.landing",
    "lanes.lanes",
    "compile.lanes",
)
_LAYOUT = ("INVERSE_MASS", "POSITION", "FRONT", "DAMPING", "SPRING", "PACK", "BACKSTOP_PART", "MAGNET")

LaneKinds = tuple[int, bool, bool]
"""Number of exponentials in the drive, whether it has a cubic part, whether a sine."""


def suits(laws: Laws) -> bool:
    """Tell whether members with these laws can run in lanes."""
    bindings = law_bindings(laws)[0]
    return bool(
        bindings["HAS_BACKSTOP"]
        and not bindings["RIGID"]
        and bindings["HAS_PACK"]
        and bindings["MEMORY"]
        and laws.pack_pulls
        and laws.backstop_pulls
    )


def specialise_lanes(laws: Laws, kinds: LaneKinds) -> Kernel:
    """Return the kernel for lanes, compiled for `laws` and the pieces that a drive consists of.

    Its entry point is `lanes`, see :mod:`printhammer.kernel.lanes.lanes`.
    """
    with one_at_a_time:
        return _specialised(laws, kinds)


@functools.cache
def _specialised(laws: Laws, kinds: LaneKinds) -> Kernel:
    plain = specialise(laws)
    sources = hashlib.sha256(repr((plain.digest, kinds)).encode())
    for name in _SOURCES:
        sources.update(source_file(name).read_bytes())
    digest = sources.hexdigest()[:16]
    flags = dict(zip(("EXPONENTIALS", "CUBIC", "SINE"), kinds, strict=True))
    scalar = {**plain.namespace, **flags, "DIGEST": digest}
    vector: dict[str, Any] = {
        name: _law(value) if isinstance(value, FunctionType) else value
        for name, value in law_bindings(laws)[0].items()
    }
    vector.update(flags, DIGEST=digest)

    def module(name: str, namespace: dict[str, Any], tag: str) -> ModuleType:
        return execute(name, f"{tag}_{digest}", namespace)

    with all_inlined():
        vector["drive_value"] = module("lanes.drive", vector, "lanes").drive_value
        forces = _with_lane_layout(module("model.forces", vector, "lanes"))
        vector["acceleration"] = forces.acceleration
        vector["backstop_acceleration"] = forces.backstop_acceleration
        vector["nystrom_step"] = module("methods.nystrom8", vector, "lanes").nystrom_step
        dop853 = module("methods.dop853", vector, "lanes")
        vector["contact_step"], vector["time_step"] = dop853.contact_step, dop853.time_step
    steps = module("lanes.steps", vector, "lanes")
    scalar["add_up"] = module("lanes.drive", scalar, "plain").add_up
    scalar.update(
        {
            name: value
            for name, value in vars(steps).items()
            if hasattr(value, "py_func") and (name.startswith("lane_") or name.endswith("_block"))
        }
    )
    for name in ("lanes.events", "lanes.landing"):
        events = module(name, scalar, "lanes")
        scalar.update(
            {
                name: value
                for name, value in vars(events).items()
                if hasattr(value, "py_func") or (name.isupper() and name not in scalar)
            }
        )
    lanes = module("lanes.lanes", scalar, "lanes")
    return Kernel({"lanes": lanes}, plain.label, scalar, digest)


def _with_lane_layout(module: ModuleType) -> ModuleType:
    """Have a template look for the constants of a hammer where lanes have them."""
    for name in _LAYOUT:
        if hasattr(module, name):
            setattr(module, name, getattr(lane_layout, name))
    return module


def _law(function: FunctionType) -> Any:
    """Compile a law, and the helpers of its module that it calls, for lanes."""
    scope = dict(function.__globals__)
    scope["math"] = lane_math
    scope.update(
        {
            name: _law(value)
            for name in function.__code__.co_names
            if isinstance(value := function.__globals__.get(name), FunctionType)
        }
    )
    return inlined(FunctionType(function.__code__, scope, function.__name__, function.__defaults__))
