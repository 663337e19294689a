"""Execution of the kernel's template modules with the laws of a hammer, or with stubs for lowering.

The template modules are ordinary source files in which the law functions are names without a value. They are
executed again under separate module names, with these names defined: as stubs for lowering, see
:mod:`printhammer.kernel.compile.lower`, or as the laws of a hammer where the kernel runs as plain Python. A
lowered template is linked with the laws of a hammer before optimisation, so that LLVM can inline every call.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import FunctionType, ModuleType
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.bindings import helpers_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

TEMPLATES = (
    "model.pulses",
    "model.circuit",
    "model.forces",
    "methods.nystrom8",
    "methods.dop853",
    "methods.crossing",
    "methods.landing",
    "methods.contact",
    "single.record",
    "single.rest",
    "single.around",
    "single.phases",
    "single.steps",
    "single.switches",
    "single.run",
    "single.resample",
    "methods.quadrature",
    "single.stretch",
    "lanes.members",
)
"""Template modules of the kernel; a module uses only names of the modules before it."""

VARIATIONAL = tuple(
    f"variational.{name}"
    for name in ("slopes", "circuit", "forcing", "supply", "columns", "steps", "switches", "flow")
)
"""Template modules of the variational equations, executed after the modules of `TEMPLATES`."""


def source_file(name: str) -> Path:
    """Return the source file of a kernel module, given its name within the kernel, e.g. "model.forces"."""
    return Path(__file__).parents[1].joinpath(*name.split(".")).with_suffix(".py")


def execute_all(templates: Sequence[str], namespace: dict[str, Any], tag: str) -> dict[str, Any]:
    """Execute templates in order, each with `namespace` and the functions of earlier templates predefined.

    Returns `namespace`, extended by the functions of all templates. `tag` is as for `execute`.
    """
    names = dict(namespace)
    for name in templates:
        module = execute(name, tag, names)
        names.update(_functions_of(module))
    return names


def _functions_of(module: ModuleType) -> dict[str, Any]:
    """Return the functions in the namespace of an executed template, by name."""
    return {
        name: value
        for name, value in vars(module).items()
        if hasattr(value, "py_func")
        or (isinstance(value, FunctionType) and value.__module__ == module.__name__)
    }


def compile_law(function: Callable[..., Any], compiled: Callable[..., Any], **names: Any) -> Any:
    """Apply the decorator `compiled` to a law and the helpers that it calls.

    `names` overrides global names in their code.
    """
    helpers = helpers_of(function) if isinstance(function, FunctionType) else {}
    if helpers or names:
        scope = {**function.__globals__, **names}
        scope.update({name: compile_law(helper, compiled, **names) for name, helper in helpers.items()})
        function = FunctionType(function.__code__, scope, function.__name__, function.__defaults__)
    return compiled(function)


def bind(function: Any, namespace: Mapping[str, Any], compiled: Callable[..., Any], known: Any = None) -> Any:
    """Apply the decorator `compiled` to a plain function and its helpers.

    `namespace` defines the names that are missing in their modules. The dictionary `known` collects the
    compiled functions, so that each function is compiled once.
    """
    known = {} if known is None else known
    if function not in known:
        scope = dict(function.__globals__)
        missing = {name for name in function.__code__.co_names if name in namespace and name not in scope}
        scope.update({name: namespace[name] for name in missing})
        for name in function.__code__.co_names:
            if isinstance(scope.get(name), FunctionType):
                scope[name] = bind(scope[name], namespace, compiled, known)
        copy = FunctionType(function.__code__, scope, function.__name__, function.__defaults__)
        known[function] = compiled(copy)
    return known[function]


def compile_module(module: ModuleType, compiled: Callable[..., Any]) -> ModuleType:
    """Return a copy of a module in which the decorator `compiled` is applied to all public functions."""
    copy = ModuleType(module.__name__)
    scope = vars(copy)
    scope.update(vars(module))
    for name, value in vars(module).items():
        if isinstance(value, FunctionType) and not name.startswith("_"):
            scope[name] = compiled(FunctionType(value.__code__, scope, name, value.__defaults__))
    return copy


def execute(template: str, tag: str, namespace: dict[str, Any]) -> ModuleType:
    """Execute a template as a new module, named with the suffix `tag`, with `namespace` predefined."""
    path, name = source_file(template), f"printhammer.kernel.{template}_{tag}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} cannot be loaded as a template of the kernel")
    module = importlib.util.module_from_spec(spec)
    vars(module).update(namespace)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module
