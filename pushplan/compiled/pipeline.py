"""Two forms of a compiled kernel: bitcode for the kernels that call it, machine code for Python.

Numba optimises each function, makes machine code and wrappers of it, and then does so again with
the same code inside each of its callers. Here a kernel that is called by kernels stays as it was
translated; the one that Python calls is optimised together with all that it calls, once.
"""

from __future__ import annotations

from typing import Any, cast

import llvmlite.binding as llvm
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, compile_result
from numba.core.compiler_machinery import register_pass
from numba.core.environment import lookup_environment
from numba.core.typed_passes import NativeLowering


class InnerFunction:
    """Stands for a kernel in the table of functions that Numba finds by their entry points."""


class OuterLibrary(JITCodeLibrary):
    """Code that is optimised when all of it is there, not also function by function before."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def environments(self) -> list[Any]:
        """Find the environments of all functions in the library, those called included."""
        names = (variable.name for variable in self._final_module.global_variables)
        found = (lookup_environment(name) for name in names if name.startswith("_ZN08NumbaEnv"))
        return [environment for environment in found if environment is not None]

    def bind(self) -> None:
        """Tell the machine code where its environments are."""
        for environment in self.environments():
            self.codegen.set_env(environment.env_name, environment)

    def machine_code(self) -> tuple[bytes, list[str]]:
        """Give the machine code with the names of what it defines."""
        module = self._final_module
        defined = [
            symbol.name
            for symbols in (module.functions, module.global_variables)
            for symbol in symbols
            if not symbol.is_declaration
        ]
        return self._get_compiled_object(), defined

    def load_machine_code(self, code: bytes, defined: list[str]) -> None:
        """Take machine code from the cache."""
        self.enable_object_caching()
        self._set_compiled_object(code)
        self._finalize_final_module()
        self._codegen._engine._defined_symbols.update(defined)


class InnerLibrary(OuterLibrary):
    """Code that its callers link in: neither optimised nor made machine code of."""

    def linkable(self) -> bytes:
        """Write the code down as LLVM's bitcode."""
        return cast(bytes, self._get_module_for_linking().as_bitcode())

    def load_bitcode(self, code: bytes) -> None:
        """Take code from the cache."""
        self._final_module = self._shared_module = llvm.parse_bitcode(code)
        self._finalized = True

    def _optimize_final_module(self) -> None:
        """Drop what is not used; addresses of this process among it, that no cache may hold."""
        builder = llvm.create_pass_builder(
            self._codegen._tm, llvm.create_pipeline_tuning_options(0)
        )
        passes = llvm.create_new_module_pass_manager()
        passes.add_sroa_pass()
        passes.add_dead_code_elimination_pass()
        passes.add_global_dead_code_eliminate_pass()
        passes.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class OuterLowering(NativeLowering):
    """Lower a kernel that Python calls."""

    _name = "outer_kernel_lowering"

    def run_pass(self, state: Any) -> bool:
        """Make machine code and a wrapper that takes Python's objects."""
        state.library = _library(OuterLibrary, state)
        super().run_pass(state)
        state.library.bind()
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class InnerLowering(NativeLowering):
    """Lower a kernel that kernels call."""

    _name = "inner_kernel_lowering"

    def run_pass(self, state: Any) -> bool:
        """Make code to be linked."""
        state.library = _library(InnerLibrary, state)
        state.flags.no_compile = True
        super().run_pass(state)
        entry = InnerFunction()
        state.targetctx.insert_user_function(entry, state.cr.fndesc, [state.library])
        state["cr"] = state.cr._replace(cfunc=entry)
        return True


class OuterCompiler(Compiler):
    """Numba's compiler with another last step."""

    lowering: type = OuterLowering

    def define_pipelines(self) -> list[Any]:
        """Put the lowering in its place."""
        (pipeline,) = super().define_pipelines()
        passes = [
            (self.lowering if step is NativeLowering else step, what)
            for step, what in pipeline.passes
        ]
        pipeline = type(pipeline)(pipeline.pipeline_name)
        for step, what in passes:
            pipeline.add_pass(step, what)
        pipeline.finalize()
        return [pipeline]


class InnerCompiler(OuterCompiler):
    """The compiler of kernels that kernels call."""

    lowering = InnerLowering


def reduced(result: Any) -> dict[str, Any]:
    """Take apart what was compiled, to be pickled."""
    library = result.library
    description = result.fndesc
    description.typemap = description.calltypes = None  # not needed again, large
    inner = isinstance(library, InnerLibrary)
    return {
        "name": library.name,
        "bitcode": library.linkable() if inner else None,
        "machine_code": None if inner else library.machine_code(),
        "fndesc": description,
        "environment": result.environment,
        "signature": result.signature,
        "reload_init": result.reload_init,
        "environments": [one for one in library.environments() if one.can_cache()],
    }


def rebuilt(parts: dict[str, Any], context: Any) -> Any:
    """Put together what `reduced` took apart.

    Args:
        parts: what it returned.
        context: Numba's target context.
    """
    for initialise in parts["reload_init"]:
        initialise()
    description = parts["fndesc"]
    environment = parts["environment"]
    entry: Any
    library: OuterLibrary
    if parts["bitcode"] is not None:
        library = InnerLibrary(context.codegen(), parts["name"])
        library.load_bitcode(parts["bitcode"])
        entry = InnerFunction()
    else:
        library = OuterLibrary(context.codegen(), parts["name"])
        library.load_machine_code(*parts["machine_code"])
        entry = context.get_executable(library, description, environment)
        for called in parts["environments"]:
            context.codegen().set_env(called.env_name, called)
    library._reload_init.update(parts["reload_init"])
    return compile_result(
        target_context=context,
        typing_context=context.typing_context,
        library=library,
        environment=environment,
        entry_point=entry,
        fndesc=description,
        signature=parts["signature"],
        objectmode=False,
        lifted=(),
        reload_init=parts["reload_init"],
        referenced_envs=parts["environments"],
    )


def _library(kind: type[OuterLibrary], state: Any) -> OuterLibrary:
    library = kind(state.targetctx.codegen(), state.func_id.func_qualname)
    library.enable_object_caching()
    return library
