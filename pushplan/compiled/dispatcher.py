"""The compiled function that `kernel` makes."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from typing import Any

from numba.core.registry import CPUDispatcher
from numba.core.types.misc import unliteral

from pushplan.compiled.cache import KernelCache
from pushplan.compiled.pipeline import InnerCompiler, OuterCompiler

Watcher = Callable[[str, bool], None]
"""Called with the name of a kernel that is ready, and whether it was in the cache."""

_WATCHERS: list[Watcher] = []


@contextmanager
def watching(watcher: Watcher) -> Iterator[None]:
    """Be told of each kernel that becomes ready to be called from Python."""
    _WATCHERS.append(watcher)
    try:
        yield
    finally:
        _WATCHERS.remove(watcher)


def cached_kernels(names: Iterable[str]) -> frozenset[str]:
    """Look up which kernels are in the cache, for the code as it is now.

    Args:
        names: ``"module.function"``, as watchers are told; those that cannot be imported here are
            left out.
    """
    return frozenset(name for name, kernel in _kernels(names) if kernel.cache.holds_current())


def compiling_kernels(names: Iterable[str]) -> frozenset[str]:
    """Look up which kernels some process compiles at the moment; ``names`` as `cached_kernels`."""
    return frozenset(name for name, kernel in _kernels(names) if kernel.cache.is_locked())


def _kernels(names: Iterable[str]) -> Iterator[tuple[str, KernelDispatcher]]:
    for name in names:
        module, _, function = name.rpartition(".")
        with suppress(ImportError):
            kernel = getattr(import_module(module), function, None)
            if isinstance(kernel, KernelDispatcher):
                yield name, kernel


class _CachedDispatcher(CPUDispatcher):
    form = ""

    def enable_caching(self) -> None:
        """Keep what is compiled on disk."""
        self._cache: KernelCache = KernelCache(self, self.form)

    @property
    def cache(self) -> KernelCache:
        """Its files on disk."""
        return self._cache

    def compile(self, sig: Any) -> Any:
        """Take the machine code for a signature from the cache, or make it."""
        if tuple(getattr(sig, "args", sig)) in self.overloads:
            return super().compile(sig)
        hits = sum(self._cache_hits.values())
        collected = gc.isenabled()
        gc.disable()  # Numba makes much that is still in use
        try:
            entry = super().compile(sig)
        finally:
            if collected:
                gc.enable()
            self._cache.release()
        if self.form == KernelDispatcher.form:
            loaded = sum(self._cache_hits.values()) > hits
            for watcher in _WATCHERS:
                watcher(f"{self.py_func.__module__}.{self.py_func.__qualname__}", loaded)
        return entry


class InnerDispatcher(_CachedDispatcher):
    """A kernel as its callers among the kernels see it."""

    form = "inner"

    def add_overload(self, cres: Any) -> None:
        """Keep it, out of Python's reach."""
        self.overloads[tuple(cres.signature.args)] = cres


class KernelDispatcher(_CachedDispatcher):
    """A kernel as Python sees it."""

    form = "outer"

    def __init__(
        self,
        py_func: Callable[..., Any],
        locals: Any = None,  # Numba's name
        targetoptions: Any = None,
        pipeline_class: type = OuterCompiler,
    ) -> None:
        """Take what Numba gives its own; see there."""
        options = {**(targetoptions or {}), "no_cfunc_wrapper": True}
        super().__init__(py_func, locals, options, pipeline_class)
        options = {**options, "no_cpython_wrapper": True}
        self.inner = InnerDispatcher(py_func, locals, options, InnerCompiler)
        self.enable_caching()
        self.inner.enable_caching()

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Tell a caller among the kernels what it returns."""
        args = tuple(unliteral(kind) for kind in args)  # not once more for each constant
        if self.is_compiling:  # it calls itself
            return super().get_call_template(args, kws)
        return self.inner.get_call_template(args, kws)

    def get_overload(self, sig: Any) -> Any:
        """Find the code that a caller among the kernels links in."""
        return self.inner.get_overload(sig)
