"""Numba compilers that keep functions as unoptimised modules, and link them before optimisation.

By default, numba compiles every function together with its callees, and links and optimises the same callees
again in every caller: a helper five calls deep is compiled five times, and four of the results are never run.
Here, the module of a helper is kept as it was lowered, and all helpers of an entry point are linked before
the result is optimised once.
"""

from __future__ import annotations

from typing import Any

from llvmlite.binding import Linkage
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, _LowerResult
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering


class _Part(JITCodeLibrary):
    """Code library with the module of a helper, which is not optimised and never run by itself."""

    kept = False
    """Whether the helper stays a separate function, i.e. is not inlined into its callers."""

    def finalize(self) -> None:
        """Mark the library as final, without the optimisation and code generation of numba."""
        self._finalized = True

    def own_module(self) -> Any:
        """Return the helper's module without its callees, ready to be linked with other modules.

        The linkage of the functions permits duplicate definitions in the other modules. The functions of a
        kept helper are not inlined.
        """
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == Linkage.external:
                function.linkage = "linkonce_odr"
                if self.kept:
                    function.add_function_attribute("noinline")
        return self._final_module

    def link_callees(self, module: Any) -> None:
        """Link the libraries of all direct and indirect callees into a module, except the stubs of laws."""
        for library in self._callees():
            if not isinstance(library, Open):
                alone = isinstance(library, _Part) and not isinstance(library, _Whole)
                module.link_in(
                    library.own_module() if alone else library._get_module_for_linking(), preserve=True
                )

    def with_callees(self, function: str, symbol: str) -> Any:
        """Return the module of a helper with all its callees linked.

        Only `function` is visible from outside, under the name `symbol`. Laws stay undefined symbols, with
        the names of their stubs.
        """
        module = self.own_module().clone()
        self.link_callees(module)
        module.get_function(function).name = symbol
        laws = {law.function: law.name for law in self._callees() if isinstance(law, Open)}
        for one in (*module.functions, *module.global_variables):
            if one.is_declaration:
                one.name = laws.get(one.name, one.name)
            else:
                one.linkage = "external" if one.name == symbol else "internal"
        return module

    def _callees(self) -> list[Any]:
        """Return the libraries of all direct and indirect callees, each before its own callees."""
        ordered: dict[Any, None] = {}
        self._add_callees(ordered)
        # The linker adds a function only if the module already refers to it, so callers come first.
        return list(reversed(ordered))

    def _add_callees(self, ordered: dict[Any, None]) -> None:
        """Add the libraries of all direct and indirect callees to `ordered`, each after its own callees."""
        for library in self._linking_libraries:
            if library not in ordered:
                if isinstance(library, _Part) and not isinstance(library, _Whole):
                    library._add_callees(ordered)
                ordered[library] = None

    def _get_module_for_linking(self) -> Any:
        # A caller compiled by numba's own compiler links only this module, so it must contain all callees.
        if self._shared_module is None:
            self._shared_module = self.own_module().clone()
            self.link_callees(self._shared_module)
        return self._shared_module


class Open(_Part):
    """Code library of the stub of a law: callers refer to its name, and no module contains its body."""

    @property
    def function(self) -> str:
        """Symbol by which callers refer to the stub."""
        return next(str(one.name) for one in self._final_module.functions if not one.is_declaration)


class _Kept(_Part):
    """Code library of a helper that stays a separate function."""

    kept = True


class _Whole(_Part):
    """Code library of a helper that Python calls, with all its callees."""

    def finalize(self) -> None:
        """Link all callees, optimise the module, and generate machine code."""
        self.link_callees(self._final_module)
        self._linking_libraries = []
        JITCodeLibrary.finalize(self)  # type: ignore[no-untyped-call]

    def _verify_declare_only_symbols(self) -> None:
        # The execution engine would call a missing function at address zero.
        for function in self._final_module.functions:
            if function.is_declaration and function.name.startswith("_ZN"):
                raise AssertionError(f"{function.name} is called but was not linked")

    def _get_module_for_linking(self) -> Any:
        return JITCodeLibrary._get_module_for_linking(self)  # type: ignore[no-untyped-call]


def _library(state: Any, kind: type[_Part]) -> None:
    library = state["library"] = kind(state.targetctx.codegen(), state.func_id.func_qualname)
    library.enable_object_caching()  # type: ignore[no-untyped-call]


@register_pass(mutates_CFG=True, analysis_only=False)  # type: ignore[no-untyped-call]
class _LowerPart(NativeLowering):
    _name = "lower_part"
    kind: type[_Part] = _Part

    def run_pass(self, state: Any) -> bool:
        _library(state, self.kind)
        state.flags.no_cpython_wrapper = state.flags.no_cfunc_wrapper = state.flags.no_compile = True
        super().run_pass(state)  # type: ignore[no-untyped-call]
        lowered = state["cr"]
        # Numba identifies a function by an entry point, which must be a built-in; this one is never called.
        key = dict[str, str]().__getitem__
        state.targetctx.insert_user_function(key, lowered.fndesc, [state["library"]])
        state["cr"] = _LowerResult(lowered.fndesc, lowered.call_helper, cfunc=key, env=lowered.env)
        return True


@register_pass(mutates_CFG=True, analysis_only=False)  # type: ignore[no-untyped-call]
class _LowerKept(_LowerPart):
    _name = "lower_kept"
    kind = _Kept


@register_pass(mutates_CFG=True, analysis_only=False)  # type: ignore[no-untyped-call]
class _LowerOpen(_LowerPart):
    _name = "lower_open"
    kind = Open


@register_pass(mutates_CFG=True, analysis_only=False)  # type: ignore[no-untyped-call]
class _LowerWhole(NativeLowering):
    _name = "lower_whole"

    def run_pass(self, state: Any) -> bool:
        _library(state, _Whole)
        state.flags.no_cfunc_wrapper = True
        return bool(super().run_pass(state))  # type: ignore[no-untyped-call]


class _Lowered(Compiler):
    """Numba's compiler with a replaced lowering pass."""

    lowering: type[NativeLowering]

    def define_pipelines(self) -> list[Any]:
        """Return numba's compiler pipelines, with the lowering pass replaced."""
        pipelines = super().define_pipelines()  # type: ignore[no-untyped-call]
        for pipeline in pipelines:
            pipeline.passes = [
                (self.lowering if stage is NativeLowering else stage, why) for stage, why in pipeline.passes
            ]
        return list(pipelines)


class PartCompiler(_Lowered):
    """Compiler of helpers that other compiled functions call and may inline."""

    lowering = _LowerPart


class KeptCompiler(_Lowered):
    """Compiler of long helpers that are not inlined; all callers share their machine code."""

    lowering = _LowerKept


class OpenCompiler(_Lowered):
    """Compiler of the stubs that stand for law functions."""

    lowering = _LowerOpen


class WholeCompiler(_Lowered):
    """Compiler of helpers that are called from Python."""

    lowering = _LowerWhole
