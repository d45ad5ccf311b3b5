"""How entries are compiled, and the kernels that only kernels call: to code that callers take in.

numba by itself optimises every function with all that it calls, and makes machine code of it, so
that what lies deep is done again at each level above. Only entries are run by themselves; the rest
is optimised once, within them.

This is built on numba's inside; ``compile.py`` says with which versions it is used.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba.core import config, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering

# Kernels run as fast with light optimisation, and are compiled in four fifths of the time.
OPTIMISATION = 1


class EntryCompiler(Compiler):
    """numba's own passes, all that is compiled within them lightly optimised."""

    def compile_extra(self, func: Callable[..., Any]) -> Any:
        """Compile a function; numba holds its lock meanwhile, and so no other is."""
        before = config.OPT
        config.OPT = type(before)(OPTIMISATION)
        try:
            return super().compile_extra(func)
        finally:
            config.OPT = before


class PartLibrary(JITCodeLibrary):
    """A kernel alone: what it calls is neither taken in nor made machine code of."""

    def finalize(self) -> None:
        """Nothing can be added any more."""
        self._finalize_dynamic_globals()
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class PartLowering(NativeLowering):
    """numba's lowering into a :class:`PartLibrary`."""

    _name = "flipflow_part_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower the function and let callers find it."""
        state.library = PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        # Callers find the code by a built-in function of its own; called from Python this one,
        # the look-up in an empty dictionary, raises, whatever the arguments.
        name = dict[Any, Any]().__getitem__
        # Callers take in what this kernel calls, too, so that an entry links each part once.
        libraries = dict.fromkeys([state.library, *state.library._linking_libraries])  # noqa: SLF001
        state.targetctx.insert_user_function(name, state.cr.fndesc, list(libraries))
        state.cr = state.cr._replace(cfunc=name)
        return True


class PartCompiler(CompilerBase):
    """numba's passes with that lowering."""

    def define_pipelines(self) -> list[Any]:
        """The one pipeline."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.passes = [
            (PartLowering if each is NativeLowering else each, why) for each, why in passes.passes
        ]
        passes.finalize()
        return [passes]


def without_literals(dispatcher: Any) -> Any:
    """Call a kernel with 0 or True as with any number: numba compiles it anew for each of them."""
    resolve = dispatcher.get_call_template

    def widened(args: tuple[types.Type, ...], kws: dict[str, types.Type]) -> Any:
        plain = {name: types.unliteral(kind) for name, kind in kws.items()}
        return resolve(tuple(types.unliteral(kind) for kind in args), plain)

    dispatcher.get_call_template = widened
    return dispatcher
