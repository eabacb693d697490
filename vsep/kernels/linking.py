"""Compilation of a kernel in one piece with everything that it calls.

Numba optimises and translates each function before it becomes part of its callers, as if Python
called it too. Python calls a third of the kernels. Here a function that a kernel calls stays as it
was lowered; it is optimised and translated where the kernel is, as a private part of it. Two
kernels share no machine code, so that none rounds differently because of what a process has loaded
or compiled before.

`tests/vsep/test_linking.py` shows that Numba as it is still needs it.
"""

import gc
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, Final

from llvmlite.binding import parse_assembly
from numba import njit
from numba.core import codegen as numba_codegen
from numba.core import compiler as numba_compiler
from numba.core import pythonapi as numba_pythonapi
from numba.core import types as numba_types

from vsep.kernels.clock import listeners, not_counted

codegen: Any = numba_codegen  # typed in part
compiler: Any = numba_compiler
pythonapi: Any = numba_pythonapi
types: Any = numba_types

# Instructions before any optimisation: what has fewer becomes part of each place that calls it;
# larger functions LLVM weighs. Numba's code is long: `cis` takes 283.
ALWAYS_INLINED: Final = 700
# Kernels that LLVM makes neither faster nor other by unrolling further, which takes a tenth of the
# time. Of others that is not known, and `all_revisions` rounds differently.
BRIEFLY: Final = frozenset(
    {
        "all_costs",
        "all_posteriors",
        "all_signals",
        "all_slopes",
        "best_candidate",
        "best_chirps",
        "first_ratios",
        "joint_slopes",
        "place_columns",
        "subtract_columns",
        "update_lines",
    }
)


class _Library(codegen.JITCodeLibrary):  # type: ignore[misc]
    def _optimize_functions(self, ll_module: Any) -> None:
        """Leave it to the optimisation of the whole, which does it once more anyway."""
        ll_module.data_layout = self._codegen._data_layout


class _Part(_Library):
    """A function that kernels call, as it was lowered.

    Only the code of others than kernels, if it calls one or shares a function of Numba's with one,
    makes Numba finish it as it would any other.
    """

    lowered: Any = None
    _final_module: Any
    environment: tuple[Any, ...] | None = None

    def add_ir_module(self, ir_module: Any) -> None:
        """Add intermediate code; what is small is marked for inlining."""
        for function in ir_module.functions:
            instructions = sum(len(block.instructions) for block in function.blocks)
            if function.name.startswith("_ZN") and 0 < instructions < ALWAYS_INLINED:
                function.attributes.add("alwaysinline")
        super().add_ir_module(ir_module)

    def finalize(self) -> None:
        """Leave everything as it is."""
        self.lowered = self._final_module
        for function in _defined(self.lowered):
            function.linkage = "linkonce_odr"
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return no address: Python does not call it."""
        del name
        return 0

    @property
    def codegen(self) -> Any:
        """Who is told the environment of the function."""
        return self

    def set_env(self, *environment: Any) -> None:
        """Remember it until there is an address that it can be written to."""
        self.environment = environment

    def _get_module_for_linking(self) -> Any:
        if self._final_module is self.lowered:
            self._final_module, self._finalized = self.lowered.clone(), False
            for function in _defined(self._final_module):
                function.linkage = "external"
            super().finalize()
            _set_environments([self], self._codegen)
        return super()._get_module_for_linking()


class _Whole(_Library):
    """A kernel that Python calls, with everything that it calls as private parts."""

    def finalize(self) -> None:
        """Link, make the parts private, optimise and translate."""
        own = {function.name for function in _defined(self._final_module)}
        parts = _callers_first(self._linking_libraries)
        self._linking_libraries: list[Any] = []
        for part in parts:
            self._reload_init.update(part._reload_init)
            lowered = getattr(part, "lowered", None) or part._get_module_for_linking()
            self._final_module.link_in(lowered, preserve=True)
        for function in _defined(self._final_module):
            if function.name not in own:
                function.linkage = "internal"
        super().finalize()
        _set_environments(parts, self._codegen)

    def _optimize_final_module(self) -> None:
        """Do as Numba does, but for the kernels of `BRIEFLY`."""
        passes, builder = self._codegen._module_pass_manager(
            loop_vectorize=False, slp_vectorize=False, opt=0, cost="cheap"
        )
        passes.run(self._final_module, builder)
        passes, builder = self._codegen._module_pass_manager(opt=2 if self.name in BRIEFLY else 3)
        passes.run(self._final_module, builder)

    def _get_module_for_linking(self) -> Any:
        """Return what the cache keeps beside the machine code: names, since nobody links it."""
        names = [function.name for function in _defined(self._final_module)]
        return parse_assembly(
            "".join(f'define void @"{name}"() {{ ret void }}\n' for name in names)
        )


def _defined(module: Any) -> list[Any]:
    """List the functions that others may call."""
    return [
        function
        for function in module.functions
        if not function.is_declaration and function.linkage.name != "internal"
    ]


def _callers_first(libraries: Iterable[Any]) -> list[Any]:
    """Order what is called, directly or not: LLVM links only what it has seen a call of."""
    finished: dict[Any, None] = {}

    def visit(library: Any) -> None:
        if library not in finished:
            if isinstance(library, _Part):
                for called in library._linking_libraries:
                    visit(called)
            finished[library] = None

    for library in libraries:
        visit(library)
    return [*finished][::-1]


def _set_environments(parts: Iterable[Any], owner: Any) -> None:
    """Write where the parts find what an exception's message is made with."""
    for part in parts:
        environment = getattr(part, "environment", None)
        if environment and owner._engine.is_symbol_defined(environment[0]):
            owner.set_env(*environment)


class _Python(pythonapi.PythonAPI):  # type: ignore[misc]
    """What a kernel is called through; it keeps classes where it keeps the types of arrays.

    Numba's asks Python for one whenever a kernel returns an array or a named tuple.
    """

    kept: Any = None

    def get_env_manager(self, *environment: Any) -> Any:
        """Remember where constants are kept."""
        self.kept = super().get_env_manager(*environment)
        return self.kept

    def serialize_object(self, value: Any) -> Any:
        """Return a class as it is."""
        if self.kept is not None and isinstance(value, type):
            return value
        return super().serialize_object(value)

    def unserialize(self, value: Any) -> Any:
        """Read a constant; the reference belongs to the caller."""
        if not isinstance(value, type):
            return super().unserialize(value)
        constant = self.kept.read_const(self.kept.add_const(value))
        self.incref(constant)
        return constant


class _PartCompiler(compiler.Compiler):  # type: ignore[misc]
    _library: type = _Part

    def define_pipelines(self) -> Any:
        """Give the function a library of ours; everything else is Numba's."""
        state = self.state
        state.library = self._library(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return super().define_pipelines()


class _WholeCompiler(_PartCompiler):
    _library = _Whole

    def _compile_core(self) -> Any:
        _tell(self.state.func_id.func_name)
        target = self.state.targetctx
        target.get_python_api = lambda builder: _Python(target, builder)
        try:
            with _parts_within(self.state.targetctx.codegen()):
                return super()._compile_core()
        finally:
            _tell("")


def _tell(kernel: str) -> None:
    for listener in tuple(listeners):
        listener(kernel)


@contextmanager
def _parts_within(owner: Any) -> Iterator[None]:
    """Let Numba's own functions be parts too, and no memory be searched for what may be freed.

    The search, of millions of objects that all are needed, takes as long as the rest of Numba.
    """
    usual, collected = owner._library_class, gc.isenabled()
    owner._library_class = _Part
    gc.disable()
    try:
        yield
    finally:
        owner._library_class = usual
        if collected:
            gc.enable()


def in_one_piece(function: Callable[..., object], options: dict[str, Any]) -> Any:
    """Return Numba's dispatcher of a kernel.

    Parameters
    ----------
    function : callable
        The kernel.
    options : dict
        Of `numba.njit`.
    """
    compiled: Any = njit
    whole = compiled(**options, pipeline_class=_WholeCompiler)(function)
    part = compiled(**options, no_cpython_wrapper=True, pipeline_class=_PartCompiler)(function)

    def keep(result: Any) -> None:
        part.overloads[tuple(result.signature.args)] = result  # and no way there from Python

    def get_call_template(args: Any, kws: Any) -> Any:
        """One code for all constants that are handed over."""
        general = [types.unliteral(kind) for kind in args]
        return part.get_call_template(general, {k: types.unliteral(v) for k, v in kws.items()})

    compile_for = whole._compile_for_args

    def get_ready(*args: Any, **kws: Any) -> Any:
        with not_counted():
            return compile_for(*args, **kws)

    whole._compile_for_args = get_ready  # what a call from Python asks for
    part.add_overload = keep
    # Numba asks this where another kernel calls it.
    whole.get_call_template, whole.get_overload = get_call_template, part.get_overload
    return whole
