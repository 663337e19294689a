"""One compiled kernel for each combination of laws.

The kernel's template modules are ordinary source files whose law functions are names without a value. For a
given :class:`~printhammer.kernel.model.laws.Laws` they are executed once more under a module name of their
own, with the chosen laws put in place, so that the compiler sees every call and can inline it. The module
name holds a digest of all sources involved: machine code cached on disk is used again for the same sources,
and never for others.
"""

from __future__ import annotations

import functools
import hashlib
import importlib
import importlib.util
import inspect
import sys
import threading
from pathlib import Path
from types import FunctionType, ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from printhammer.kernel.model.laws import Laws

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
"""Template modules of the kernel in the order in which they use one another."""

ENTRIES = {
    "run": "runs",
    "resample": "curves",
    "quadratures": "energies",
    "peaks": "peaks",
    "members": "many runs",
    "lanes": "many runs side by side",
    "flow": "derivatives",
}
"""Names of the entry points, and what each of them computes."""

_PLAIN = (
    "model.modes",
    "model.layout",
    "model.transitions",
    "model.dots",
    "single.carry",
    "lanes.batch",
    "methods.hermite",
    "compile.compiling",
    "compile.linking",
    "methods.dop853_tableau",
    "methods.nystrom8_tableau",
)

_LAW_FUNCTIONS = {
    "magnet": (
        "magnet_force",
        "magnet_energy",
        "magnet_linkage",
        "magnet_emf",
        "magnet_inductance",
        "magnet_current",
    ),
    "spring": ("spring_force", "spring_energy"),
    "pack": ("pack_loading", "pack_memory", "pack_unloading", "pack_switch"),
    "backstop": (
        "backstop_elastic",
        "backstop_viscous",
        "backstop_energy",
        "backstop_switch",
        "backstop_rebound",
    ),
    "damping": ("damping_force",),
}

begin_ahead: Callable[[Laws], Callable[[], None]] | None = None
"""Called with the laws before `run` is compiled: has the entry points `AHEAD` compiled elsewhere meanwhile.

What it returns waits for these.
"""

AHEAD = ("peaks", "quadratures", "resample")
"""Entry points that whoever runs a hammer wants next."""


class Kernel:
    """The compiled functions of one combination of laws.

    Its entry points `run`, `resample`, `quadratures`, `peaks` and `members` are those of the template modules
    of the same names. Kernels for lanes and for variational equations have an entry point of their own,
    `lanes` or `flow`. The `label` says what the kernel is for, the `digest` is that of all its sources, and
    the `namespace` has all that its modules define, for what builds on them.
    """

    laws: Laws | None = None
    _wait: Callable[[], None] | None = None

    def __init__(
        self, modules: dict[str, ModuleType], label: str, namespace: dict[str, Any], digest: str
    ) -> None:
        self.namespace = namespace
        self.digest = digest
        self.label = label
        self._entries = {
            name: getattr(module, name)
            for module in modules.values()
            for name in ENTRIES
            if hasattr(module, name) and getattr(module, name).__module__ == module.__name__
        }
        for name, function in self._entries.items():
            # Plain Python where NUMBA_DISABLE_JIT is set.
            if hasattr(function, "py_func"):
                cache = function._cache
                cache.kind, cache.label = ENTRIES[name], label
                if name in ("run", *AHEAD):
                    others = [other for other in ("run", *AHEAD) if other in self._entries and other != name]
                    cache.with_it = tuple(self._entries[other]._cache for other in others)

    def __getattr__(self, name: str) -> Any:
        """Return an entry point, with others compiled elsewhere where that is wanted."""
        try:
            function = self.__dict__["_entries"][name]
        except KeyError:
            raise AttributeError(name) from None
        if begin_ahead is not None and self.laws is not None and not is_ready(function):
            if name == "run" and function._cache.cache_path is not None:
                self._wait = begin_ahead(self.laws)
                function._cache.with_it = ()
            elif name in AHEAD and self._wait is not None:
                wait, self._wait = self._wait, None
                wait()
        return function


def is_ready(function: Any) -> bool:
    """Tell whether an entry point is compiled in this process or has machine code on disk."""
    # Plain Python where NUMBA_DISABLE_JIT is set.
    if not hasattr(function, "py_func") or function.signatures:
        return True
    return bool(function._cache.holds(function.targetctx))


def _source(module: ModuleType) -> bytes:
    return inspect.getsource(module).encode()


def source_file(name: str) -> Path:
    """Return the file of a module of the kernel, named from there, such as "model.forces"."""
    return Path(__file__).parents[1].joinpath(*name.split(".")).with_suffix(".py")


def law_bindings(laws: Laws) -> tuple[dict[str, Any], bytes]:
    """Return the plain law functions and flags by name, and the text of all sources they come from."""
    absent = importlib.import_module(laws.absent)
    bindings: dict[str, Any] = {}
    text = _source(absent)
    for role, functions in _LAW_FUNCTIONS.items():
        name = getattr(laws, role)
        module = importlib.import_module(name) if name else absent
        text += _source(module)
        for function in functions:
            bindings[function] = getattr(module, function, None) or getattr(absent, function)
        used = {name for function in functions for name in _modules_of(bindings[function])}
        others = sorted(used - {module.__name__, absent.__name__})
        text += b"".join(_source(sys.modules[other]) for other in others)
        bindings[f"HAS_{role.upper()}"] = bool(name)
        if role == "pack":
            bindings["MEMORY"] = bool(getattr(module, "MEMORY", False))
        if role == "backstop":
            bindings["RIGID"] = bool(getattr(module, "RIGID", False))
    bindings["FORCE_DRIVE"] = laws.force_drive
    bindings["HAS_CIRCUIT"] = laws.circuit
    bindings["PACK_PULLS"] = laws.pack_pulls
    bindings["BACKSTOP_PULLS"] = laws.backstop_pulls
    bindings["RELOAD_ALONG_UNLOADING"] = laws.reload_along_unloading
    return bindings, text


one_at_a_time = threading.RLock()


def specialise(laws: Laws) -> Kernel:
    """Return the kernel compiled for `laws`; the same object for equal laws.

    Its entry points compile on their first call, or load their machine code from disk. ImportError if a
    module named in `laws` cannot be imported.
    """
    with one_at_a_time:
        return _specialised(laws)


@functools.cache
def _specialised(laws: Laws) -> Kernel:
    import numba

    bindings, text = law_bindings(laws)
    for name in _PLAIN:
        text += source_file(name).read_bytes()
    sources = hashlib.sha256(text + repr((laws, numba.__version__)).encode())
    compiled = importlib.import_module("printhammer.kernel.compile.compiling").compiled
    namespace = {
        name: compile_law(value, compiled) if isinstance(value, FunctionType) else value
        for name, value in bindings.items()
    }
    parts = [getattr(laws, role).rpartition(".")[2] for role in _LAW_FUNCTIONS if getattr(laws, role)]
    label = f"laws {', '.join(parts)}" if parts else "a free mass"
    if laws.circuit:
        label += " with the coil's circuit"
    kernel = execute_all(TEMPLATES, namespace, sources, label)
    kernel.laws = laws
    return kernel


def execute_all(
    templates: Sequence[str], namespace: dict[str, Any], sources: hashlib._Hash, label: str
) -> Kernel:
    """Execute templates one after the other, each with the functions of those before it in its `namespace`.

    `sources` is a hash of all that the namespace holds already.
    """
    modules: dict[str, ModuleType] = {}
    for name in templates:
        # A template uses only those before it: a change of a later one leaves its machine code valid.
        sources.update(source_file(name).read_bytes())
        namespace["DIGEST"] = sources.hexdigest()[:16]
        modules[name] = module = execute(name, namespace["DIGEST"], namespace)
        namespace.update(functions_of(module))
    return Kernel(modules, label, namespace, namespace["DIGEST"])


def functions_of(module: ModuleType) -> dict[str, Any]:
    """Return the functions that a template defines or has been given, by name."""
    return {
        name: value
        for name, value in vars(module).items()
        if hasattr(value, "py_func")
        or (isinstance(value, FunctionType) and value.__module__ == module.__name__)
    }


def compile_law(function: Callable[..., Any], compiled: Callable[..., Any]) -> Any:
    """Compile a law, together with the helpers that it calls."""
    if isinstance(function, FunctionType) and (helpers := _helpers_of(function)):
        scope = dict(function.__globals__)
        scope.update({name: compile_law(helper, compiled) for name, helper in helpers.items()})
        function = FunctionType(function.__code__, scope, function.__name__, function.__defaults__)
    return compiled(function)


def _helpers_of(function: FunctionType) -> dict[str, FunctionType]:
    """Return the functions that a law calls, by the name that it uses."""
    return {
        name: value
        for name in function.__code__.co_names
        if isinstance(value := function.__globals__.get(name), FunctionType)
    }


def _modules_of(function: FunctionType) -> set[str]:
    """Return the names of the modules of a law and all that it calls."""
    return {function.__module__}.union(*(_modules_of(helper) for helper in _helpers_of(function).values()))


def execute(template: str, tag: str, namespace: dict[str, Any]) -> ModuleType:
    """Execute a template as a module of its own, told by `tag`, in which `namespace` is already defined."""
    path, name = source_file(template), f"printhammer.kernel.{template}_{tag}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} cannot be loaded as a template of the kernel")
    module = importlib.util.module_from_spec(spec)
    vars(module).update(namespace)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module
