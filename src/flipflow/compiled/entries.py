"""How kernels that run by themselves are compiled: entries, and what entries share.

A shared kernel is compiled once, apart from the entries that call it by its symbol: what many of
them need, as the flow and its modes, would else be compiled anew within each. Callers know it by
the types of its arguments and by the type that its annotation says it returns; its code is fetched,
or compiled, when the first caller is made ready to run.

This is built on numba's inside; ``compile.py`` says with which versions it is used.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite.binding import Linkage
from numba.core import config, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder, Flags
from numba.core.compiler_machinery import register_pass
from numba.core.funcdesc import FunctionDescriptor
from numba.core.typed_passes import NativeLowering
from numba.core.typing import make_concrete_template, signature

# Kernels run as fast with light optimisation, and are compiled in four fifths of the time.
OPTIMISATION = 1
RETURNED = {
    "None": types.none,
    "bool": types.boolean,
    "int": types.int64,
    "float": types.float64,
    "tuple[float, float]": types.UniTuple(types.float64, 2),
    "tuple[float, float, float, float]": types.UniTuple(types.float64, 4),
}

# The shared kernel and the types of its arguments that each symbol stands for.
_SHARED: dict[str, tuple[Any, Any]] = {}


class EntryLibrary(JITCodeLibrary):
    """Code that runs by itself, ready once the shared kernels that it calls are in memory."""

    shared: list[tuple[Any, Any]]

    def _optimize_final_module(self) -> None:
        # What only this code calls need not keep numba's way of passing arguments: an array is
        # handed over as half a dozen numbers, most of which no callee reads.
        for each in self._final_module.functions:
            if not each.is_declaration and each.linkage == Linkage.linkonce_odr:
                each.linkage = Linkage.internal
        super()._optimize_final_module()

    def _finalize_final_module(self) -> None:
        named = [each.name for each in self._final_module.functions if each.is_declaration]
        self.shared = [_SHARED[name] for name in named if name in _SHARED]
        for dispatcher, called in self.shared:
            dispatcher.compile(called)
        super()._finalize_final_module()


@register_pass(mutates_CFG=True, analysis_only=False)
class EntryLowering(NativeLowering):
    """numba's lowering into an :class:`EntryLibrary`."""

    _name = "flipflow_entry_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower the function."""
        state.library = EntryLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return bool(super().run_pass(state))


@register_pass(mutates_CFG=True, analysis_only=False)
class SharedLowering(EntryLowering):
    """The same under a symbol that is alike in every process: without numba's running number."""

    _name = "flipflow_shared_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower the function."""
        state.func_ir.func_id.unique_id = None
        return super().run_pass(state)


class EntryCompiler(CompilerBase):
    """numba's passes with that lowering, all that is compiled within them lightly optimised."""

    lowering: type[NativeLowering] = EntryLowering

    def define_pipelines(self) -> list[Any]:
        """The one pipeline."""
        return [with_lowering(self.state, self.lowering)]

    def compile_extra(self, func: Callable[..., Any]) -> Any:
        """Compile a function; numba holds its lock meanwhile, and so no other is."""
        before = config.OPT
        config.OPT = type(before)(OPTIMISATION)
        try:
            return super().compile_extra(func)
        finally:
            config.OPT = before


class SharedCompiler(EntryCompiler):
    """The same for a shared kernel."""

    lowering = SharedLowering


def with_lowering(state: Any, lowering: type[NativeLowering]) -> Any:
    """numba's passes, with another lowering in place of its own."""
    passes = DefaultPassBuilder.define_nopython_pipeline(state)
    passes.passes = [
        (lowering if each is NativeLowering else each, why) for each, why in passes.passes
    ]
    passes.finalize()
    return passes


def called_by_name(dispatcher: Any) -> Any:
    """Let kernels call a shared kernel by its symbol, without compiling it first."""
    function, target = dispatcher.py_func, dispatcher.targetctx
    answer = RETURNED.get(function.__annotations__.get("return"))
    if answer is None:
        raise TypeError(f"{function.__name__}: a shared kernel returns {', '.join(RETURNED)}")
    flags = Flags()
    dispatcher.targetdescr.options.parse_as_flags(flags, dispatcher.targetoptions)

    def described(args: tuple[types.Type, ...]) -> FunctionDescriptor:
        return FunctionDescriptor(
            native=True, modname=function.__module__, qualname=function.__qualname__,
            unique_name=function.__qualname__, doc=None, typemap=None, restype=answer,
            calltypes=None, args=tuple(f"arg{i}" for i in range(len(args))), kws=(),
            mangler=target.mangler, argtypes=args, abi_tags=[flags.get_mangle_string()],
        )  # fmt: skip

    def declared(args: tuple[types.Type, ...], kws: dict[str, types.Type]) -> Any:
        python, args = dispatcher.fold_argument_types(args, kws)
        called = signature(answer, *map(types.unliteral, args))
        descriptor = described(called.args)
        symbol = descriptor.mangled_name
        if symbol not in _SHARED:
            target.insert_user_function(symbol, descriptor)
            _SHARED[symbol] = (dispatcher, called)
        template = make_concrete_template(function.__name__, function.__name__, [called])
        return template, python, args, {}

    def called_from_python(*_: Any, **__: Any) -> None:
        raise TypeError(f"{function.__name__} is called by kernels only")

    dispatcher.get_call_template = declared
    dispatcher.get_overload = lambda args: described(tuple(args)).mangled_name
    # It has no wrapper that Python could call.
    dispatcher.add_overload = lambda made: dispatcher.overloads.update({made.signature.args: made})
    dispatcher._compile_for_args = called_from_python  # noqa: SLF001  numba offers no other way
    return dispatcher
