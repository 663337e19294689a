"""Names that a template leaves undefined: laws, linked from other modules, and choices, set at linking.

Both are ordinary Python names in the source of a template. The numba extensions below compile a law as a call
of an external function, and a choice as the value of an external constant.
"""

from __future__ import annotations

import operator
from typing import TYPE_CHECKING, Any

from llvmlite import ir
from numba import types
from numba.core.datamodel import models
from numba.core.datamodel.registry import register_default
from numba.core.extending import typeof_impl
from numba.core.imputils import lower_builtin, lower_cast, lower_constant
from numba.core.typeconv.castgraph import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature

from printhammer.kernel.compile.compiling import opened
from printhammer.kernel.compile.link import CHOICE, INTEGER

if TYPE_CHECKING:
    from collections.abc import Callable

# The type annotations of numba are incomplete.
_typeof_impl: Any = typeof_impl
_register: Any = register_default
_infer: Any = infer_global
_builtin: Any = lower_builtin
_cast_of: Any = lower_cast
_constant: Any = lower_constant
_signature: Any = signature


class Choice:
    """Stand-in for a boolean or integer constant whose value is set when modules are linked."""

    def __init__(self, name: str, base: Any) -> None:
        self.name, self.base = name, base

    def __bool__(self) -> bool:
        """Raise TypeError, so that numba does not evaluate a condition and keeps both branches."""
        raise TypeError(f"{self.name} is set when modules are linked")


class _ChoiceType(types.Type):
    def __init__(self, base: Any) -> None:
        self.base = base
        super().__init__(f"choice({base})")

    def can_convert_to(self, typingctx: Any, other: Any) -> Any:
        """Return numba's rank of the conversion to another type: that of the base type, at best `safe`."""
        conversion = typingctx.can_convert(self.base, other)
        return None if conversion is None else max(conversion, Conversion.safe)

    def unify(self, typingctx: Any, other: Any) -> Any:
        """Return the common numba type of the choice's base type and another type."""
        return typingctx.unify_pairs(self.base, other)


@_typeof_impl.register(Choice)  # type: ignore[untyped-decorator]
def _typeof(value: Choice, _context: Any) -> Any:
    return _ChoiceType(value.base)


@_register(_ChoiceType)
class _ChoiceModel(models.PrimitiveModel):
    def __init__(self, manager: Any, frontend: Any) -> None:
        width = 8 if frontend.base == types.boolean else 64
        super().__init__(manager, frontend, ir.IntType(width))  # type: ignore[no-untyped-call]


@_constant(_ChoiceType)  # type: ignore[untyped-decorator]
def _load(context: Any, builder: Any, kind: Any, value: Choice) -> Any:
    name = CHOICE + value.name + ("" if value.base == types.boolean else INTEGER)
    try:
        place = builder.module.get_global(name)
    except KeyError:
        place = ir.GlobalVariable(builder.module, context.get_value_type(kind), name)
        place.global_constant = True
        place.linkage = "external"
    return builder.load(place)


@_cast_of(_ChoiceType, types.Boolean)  # type: ignore[untyped-decorator]
@_cast_of(_ChoiceType, types.Integer)  # type: ignore[untyped-decorator]
def _cast(context: Any, builder: Any, source: Any, target: Any, value: Any) -> Any:
    if source.base == types.boolean:
        value = builder.icmp_unsigned("!=", value, ir.Constant(value.type, 0))
    return context.cast(builder, value, source.base, target)


@_infer(operator.truth)
@_infer(operator.not_)
class _Truth(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        """Return the signature of a truth test of a choice, with a boolean result; None for other types."""
        return _signature(types.boolean, *args) if isinstance(args[0], _ChoiceType) and not kws else None


@_builtin(bool, _ChoiceType)  # type: ignore[untyped-decorator]
def _truth(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
    return _cast(context, builder, kinds.args[0], types.boolean, values[0])


@_builtin(operator.not_, _ChoiceType)  # type: ignore[untyped-decorator]
def _not(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
    return builder.not_(_truth(context, builder, kinds, values))


def law(name: str, symbol: str, floats: int) -> Callable[..., float]:
    """Return a stub of the law `name`, from which its callers are compiled as calls of `symbol`.

    The arguments of the stub are the array of constants and `floats` numbers.
    """
    arguments = ", ".join(f"a{i}" for i in range(floats))
    scope: dict[str, Any] = {"__name__": __name__}
    exec(f"def {name}(c, {arguments}):\n    return 0.0\n", scope)
    function: Callable[..., float] = scope[name]
    function.__qualname__ = symbol
    return opened(function)
