"""How kernels that only kernels call are compiled: to code that callers take in.

numba by itself optimises every function with all that it calls, and makes machine code of it, so
that what lies deep is done again at each level above. Only entries are run by themselves; the rest
is optimised once, within them.

This is built on numba's inside; ``compile.py`` says with which versions it is used.
"""

from __future__ import annotations

from typing import Any

from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering

from flipflow.compiled.entries import with_lowering


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
        return [with_lowering(self.state, PartLowering)]


def without_literals(dispatcher: Any) -> Any:
    """Call a kernel with 0 or True as with any number: numba compiles it anew for each of them."""
    resolve = dispatcher.get_call_template

    def widened(args: tuple[types.Type, ...], kws: dict[str, types.Type]) -> Any:
        plain = {name: types.unliteral(kind) for name, kind in kws.items()}
        return resolve(tuple(types.unliteral(kind) for kind in args), plain)

    dispatcher.get_call_template = widened
    return dispatcher
