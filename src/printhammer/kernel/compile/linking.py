"""Compilers for the functions of a kernel: each stays a part, and a template is all parts that it calls.

Numba compiles each function to machine code of its own, with all that it calls, and then links and optimises
the same functions again in whatever calls it: a helper five calls deep is compiled five times over, and the
machine code of four is never run. Here the module of a helper is kept as it was lowered, and all helpers of
an entry point are linked before anything is optimised.
"""

from __future__ import annotations

from typing import Any

from llvmlite.binding import Linkage
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, _LowerResult
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering


class _Part(JITCodeLibrary):
    """The module of a helper, not optimised and never run by itself."""

    kept = False
    """Whether the helper stays a function in what calls it."""

    def finalize(self) -> None:
        """Let nothing be added any more."""
        self._finalized = True

    def own_module(self) -> Any:
        """Return the module of the helper alone, its functions such that several modules may have them."""
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == Linkage.external:
                function.linkage = "linkonce_odr"
                if self.kept:
                    function.add_function_attribute("noinline")
        return self._final_module

    def link_callees(self, module: Any) -> None:
        """Link all that this library calls, directly or through others, into a module, but for laws."""
        for library in self._callees():
            if not isinstance(library, Open):
                alone = isinstance(library, _Part) and not isinstance(library, _Whole)
                module.link_in(
                    library.own_module() if alone else library._get_module_for_linking(), preserve=True
                )

    def with_callees(self, function: str, symbol: str) -> Any:
        """Return the module of a helper with all that it calls.

        From outside only `function` is seen, under the name `symbol`. Laws stay open, under the names of
        their stubs.
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
        """Return the libraries that this one calls, directly or through others."""
        ordered: dict[Any, None] = {}
        self._add_callees(ordered)
        # The linker takes a function only if what is there already calls it: callers come first.
        return list(reversed(ordered))

    def _add_callees(self, ordered: dict[Any, None]) -> None:
        """Add the libraries that this one calls, directly or through others, each after those it calls."""
        for library in self._linking_libraries:
            if library not in ordered:
                if isinstance(library, _Part) and not isinstance(library, _Whole):
                    library._add_callees(ordered)
                ordered[library] = None

    def _get_module_for_linking(self) -> Any:
        # What numba's own compiler makes of a caller links this and nothing else.
        if self._shared_module is None:
            self._shared_module = self.own_module().clone()
            self.link_callees(self._shared_module)
        return self._shared_module


class Open(_Part):
    """The stub of a law, of which callers know the name, and which no module has."""

    @property
    def function(self) -> str:
        """Symbol of the stub in what calls it."""
        return next(str(one.name) for one in self._final_module.functions if not one.is_declaration)


class _Kept(_Part):
    """The module of a helper that stays a function."""

    kept = True


class _Whole(_Part):
    """The module of a helper that Python calls, with all that it calls."""

    def finalize(self) -> None:
        """Link, optimise and make machine code."""
        self.link_callees(self._final_module)
        self._linking_libraries = []
        JITCodeLibrary.finalize(self)  # type: ignore[no-untyped-call]

    def _verify_declare_only_symbols(self) -> None:
        # The engine would call what is missing at address zero.
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
        # Callers know a function by its entry point, which has to be a built-in; nobody calls this one.
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
    """The compiler of numba with another way to lower a function."""

    lowering: type[NativeLowering]

    def define_pipelines(self) -> list[Any]:
        """Return the pipelines of numba, the lowering replaced."""
        pipelines = super().define_pipelines()  # type: ignore[no-untyped-call]
        for pipeline in pipelines:
            pipeline.passes = [
                (self.lowering if stage is NativeLowering else stage, why) for stage, why in pipeline.passes
            ]
        return list(pipelines)


class PartCompiler(_Lowered):
    """Compiler of helpers, which other compiled functions call."""

    lowering = _LowerPart


class KeptCompiler(_Lowered):
    """Compiler of long helpers with several callers: their machine code is made once for all of these."""

    lowering = _LowerKept


class OpenCompiler(_Lowered):
    """Compiler of stubs of laws."""

    lowering = _LowerOpen


class WholeCompiler(_Lowered):
    """Compiler of helpers that Python calls."""

    lowering = _LowerWhole
