"""Lowering: translation of Python functions to LLVM bitcode, by numba.

The template of an entry point is a module of the entry point and all its callees, in which laws and choices
stay undefined, so that one template serves every hammer. The laws of a part are a separate module. Since the
types of all arguments are fixed, most entry points have only two templates: with and without a coil circuit.
"""

from __future__ import annotations

import functools
from types import ModuleType
from typing import TYPE_CHECKING, Any

import llvmlite.binding as llvm
from numba import types

from printhammer.kernel.compile import opening
from printhammer.kernel.compile.compiling import all_inlined, compiled, inlined
from printhammer.kernel.compile.link import ENTRY, law_symbol
from printhammer.kernel.compile.signatures import RESULTS, signature_of
from printhammer.kernel.compile.templates import (
    TEMPLATES,
    VARIATIONAL,
    bind,
    compile_law,
    compile_module,
    execute,
    execute_all,
)
from printhammer.kernel.lanes import layout as lane_layout
from printhammer.kernel.lanes import math as lane_math
from printhammer.kernel.model import laws as declared
from printhammer.kernel.model.laws import LAW_FUNCTIONS, floats_of
from printhammer.kernel.variational.layout import electric_row

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from printhammer.kernel.compile.signatures import Plain

_LAYOUT = ("INVERSE_MASS", "POSITION", "FRONT", "DAMPING", "SPRING", "PACK", "BACKSTOP_PART", "MAGNET")

_NUMBERS = {"f": types.float64, "s": types.float32, "i": types.int64, "b": types.boolean}


def template(entry: str, variant: Mapping[str, bool]) -> bytes:
    """Lower the template of an entry point; return LLVM bitcode.

    The flags of `variant` are `HAS_CIRCUIT`, whether the hammer has a coil circuit, and, for `flow`,
    `FORCED`, whether the tangent columns include derivatives with respect to constants.
    """
    if entry == "lanes":
        namespace = _lanes()
    elif entry == "flow":
        namespace = _flow(variant["HAS_CIRCUIT"], variant["FORCED"])
    else:
        namespace = _plain(variant["HAS_CIRCUIT"])
    return _entry(namespace[entry], entry, signature_of(entry, variant), RESULTS[entry])


def plain(name: str, entry: Plain, circuit: bool | None, packing: Mapping[str, Any]) -> bytes:
    """Lower a function outside the kernel as the entry point `name`; return LLVM bitcode.

    `circuit` states whether the hammer has a coil circuit; None for a function that uses no names of the
    kernel. `packing` holds, by name, the functions that pack constants.
    """
    namespace = {**packing, **({} if circuit is None else _plain(circuit))}
    return _entry(bind(entry.function, namespace, compiled), name, entry.arguments, entry.results)


def _entry(function: Any, name: str, signature: Any, results: int) -> bytes:
    """Lower a compiled function and its callees as an entry point `name`; return LLVM bitcode.

    Raises TypeError if the function does not return `results` integers.
    """
    library, symbol, kind = _lowered(function, tuple(map(_types, signature)))
    expected = {0: types.none, 1: types.int64}.get(results, _tuple([types.int64] * results))
    if types.unliteral(kind) != expected:  # type: ignore[no-untyped-call]
        raise TypeError(f"{name} returns {kind}, expected {expected}")
    return bytes(library.with_callees(symbol, ENTRY).as_bitcode())


def laws(role: str, functions: Mapping[str, Callable[..., Any]], for_lanes: bool) -> bytes:
    """Lower the law functions of the part `role`, e.g. "pack", to one module; return LLVM bitcode."""
    whole = llvm.parse_assembly("")
    for name in LAW_FUNCTIONS[role]:
        constants: Any = types.Array(types.float64, 1, "C")
        function = functions[name]
        if for_lanes:
            constants = _tuple([types.float64] * lane_layout.PLACES[role][1])
            helper = compile_law(function, inlined, math=_lane_math())
        else:
            helper = compile_law(function, compiled)
        library, symbol, kind = _lowered(helper, (constants, *(types.float64,) * floats_of(name)))
        if kind != types.float64:
            raise TypeError(f"{function.__module__}.{name} returns {kind}, expected a float")
        whole.link_in(library.with_callees(symbol, law_symbol(name, for_lanes)))
    return bytes(whole.as_bitcode())


@functools.cache
def _lane_math() -> ModuleType:
    """Return the elementary functions for lanes as a module of inlined functions."""
    return compile_module(lane_math, inlined)


def _lowered(function: Any, arguments: tuple[Any, ...]) -> tuple[Any, str, Any]:
    """Lower a function for given argument types; return its code library, symbol and result type."""
    function.compile(arguments)
    result = function.overloads[arguments]
    fields = result._asdict()
    return fields["library"], fields["fndesc"].llvm_func_name, fields["signature"].return_type


def _types(signature: Any) -> Any:
    """Return the numba type of a type code, such as "f1"; for a tuple of codes, the tuple of types."""
    if isinstance(signature, str):
        number = _NUMBERS[signature[0]]
        return types.Array(number, int(signature[1]), "C") if len(signature) == 2 else number
    named = type(signature) if hasattr(signature, "_fields") else None
    return _tuple([_types(element) for element in signature], named)


def _tuple(elements: list[Any], named: type | None = None) -> Any:
    return types.BaseTuple.from_types(tuple(elements), named)  # type: ignore[no-untyped-call]


def _opened() -> dict[str, Any]:
    """Return stand-ins for all laws and choices that a template leaves undefined, by name."""
    namespace: dict[str, Any] = {}
    for name, kind in declared.__annotations__.items():
        if kind in ("bool", "int"):
            namespace[name] = opening.Choice(name, types.boolean if kind == "bool" else types.int64)
    for name in (name for functions in LAW_FUNCTIONS.values() for name in functions):
        namespace[name] = opening.law(name, law_symbol(name, False), floats_of(name))
    return namespace


@functools.cache
def _plain(circuit: bool) -> dict[str, Any]:
    namespace = {**_opened(), "HAS_CIRCUIT": circuit}
    return execute_all(TEMPLATES, namespace, f"template_{int(circuit)}")


@functools.cache
def _flow(circuit: bool, forced: bool) -> dict[str, Any]:
    own = {"FORCED": forced, "ELECTRIC_ROW": electric_row(forced)}
    return execute_all(VARIATIONAL, {**_plain(circuit), **own}, f"template_{int(circuit)}{int(forced)}")


@functools.cache
def _lanes() -> dict[str, Any]:
    vector: dict[str, Any] = {
        name: value for name, value in _opened().items() if isinstance(value, opening.Choice)
    }
    for name in (name for functions in LAW_FUNCTIONS.values() for name in functions):
        vector[name] = opening.law(name, law_symbol(name, True), floats_of(name))
    return _execute_lanes(_plain(False), {**vector, "HAS_CIRCUIT": False})


def _execute_lanes(plain: dict[str, Any], vector: dict[str, Any]) -> dict[str, Any]:
    """Execute the templates of the lane kernel, bound to laws without branches or calls.

    Total force and step functions are taken from the scalar kernel, with :mod:`printhammer.kernel.lanes.math`
    in place of :mod:`math`, the drive in closed form, the constants of a hammer as a tuple, and all functions
    inlined. The functions that handle events are scalar and use the scalar kernel. `plain` is the namespace
    of the scalar kernel's templates; `vector` holds the laws for lanes, and the compile-time choices.
    """
    scalar, vector = ({**names, "lane_math": _lane_math()} for names in (plain, vector))

    def module(name: str, namespace: dict[str, Any], kind: str) -> ModuleType:
        return execute(name, f"{kind}_template", namespace)

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
    return {"lanes": module("lanes.lanes", scalar, "lanes").lanes}


def _with_lane_layout(module: ModuleType) -> ModuleType:
    """Replace the parameter indices in a template module with the indices of the layout of lanes."""
    for name in _LAYOUT:
        if hasattr(module, name):
            setattr(module, name, getattr(lane_layout, name))
    return module
