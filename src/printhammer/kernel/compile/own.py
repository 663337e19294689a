"""Lowering of user-defined laws to modules, using only numba's public interface.

Templates and shipped laws are lowered when the wheel is built, with private classes of numba. A user-defined
law is lowered on the user's machine, and must therefore work with any version of numba.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import llvmlite.binding as llvm
import numba
from numba import types
from numba.core.errors import NumbaError, UnsupportedBytecodeError

from printhammer.errors import InputError
from printhammer.kernel.compile.link import law_symbol
from printhammer.kernel.compile.templates import compile_law, compile_module
from printhammer.kernel.lanes import layout as lane_layout
from printhammer.kernel.lanes import math as lane_math
from printhammer.kernel.model.laws import LAW_FUNCTIONS, floats_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

_OPTIONS: Final[dict[str, Any]] = {
    "error_model": "numpy",
    "fastmath": {"contract"},
    "nogil": True,
    "_nrt": False,
}
"""Compiler options, the same as in :mod:`printhammer.kernel.compile.compiling`."""

_NO_REASON: Final = ("Failed in", "Resolution failure")
"""First words of lines in a numba typing error that name a compiler pass instead of the reason."""

_FOR_C: Final = "cfunc."
"""Prefix of the symbol of numba's C wrapper of a function; the symbol of the function itself follows."""


def laws(role: str, functions: Mapping[str, Callable[..., Any]], for_lanes: bool) -> bytes:
    """Lower the law functions of a part to one module; return LLVM bitcode.

    Raises
    ------
    InputError
        Numba cannot compile a function; the message names the function and the reason.
    """

    def compiled(function: Any) -> Any:
        return numba.njit(**_OPTIONS)(function)

    constants: Any = types.Array(types.float64, 1, "C")
    names = {}
    if for_lanes:
        constants = types.UniTuple(  # type: ignore[no-untyped-call]
            types.float64, lane_layout.PLACES[role][1]
        )
        names["math"] = compile_module(lane_math, compiled)
    whole = llvm.parse_assembly("")
    for name in LAW_FUNCTIONS[role]:
        arguments = (constants, *(types.float64,) * floats_of(name))
        law = compile_law(functions[name], compiled, **names).py_func
        try:
            lowered = numba.njit(types.float64(*arguments), **_OPTIONS)(law)
        except (NumbaError, UnsupportedBytecodeError) as error:
            lines = (line.strip(" -") for line in str(error).splitlines())
            reasons = [line for line in lines if line and not line.startswith(_NO_REASON)]
            raise InputError.of(
                name,
                reasons[0],
                "a law of floats that calls only `math` and functions of its own module",
                file=functions[name].__code__.co_filename,
            ) from error
        whole.link_in(_alone(lowered.inspect_llvm(arguments), law_symbol(name, for_lanes)))
    return bytes(whole.as_bitcode())


def _alone(text: str, symbol: str) -> Any:
    """Return a function's LLVM assembly as a module from which only the function, as `symbol`, is visible."""
    module = llvm.parse_assembly(text)
    (name,) = (
        function.name.removeprefix(_FOR_C)
        for function in module.functions
        if function.name.startswith(_FOR_C)
    )
    module.get_function(name).name = symbol
    for one in (*module.functions, *module.global_variables):
        if not one.is_declaration:
            one.linkage = "external" if one.name == symbol else "internal"
    return module
