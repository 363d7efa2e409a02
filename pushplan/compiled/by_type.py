"""Kernels that are chosen by the type of their first argument."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba.core.errors import TypingError

from pushplan.compiled.dispatcher import KernelDispatcher
from pushplan.compiled.fingerprint import add_type_kernels


class KernelByType(KernelDispatcher):
    """Stands for one kernel per class of named tuples; a decorator.

    Kernels that call it link the chosen one in as if they had named it. The decorated function
    only says what the arguments are.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        """Know no kernel yet."""
        super().__init__(function, targetoptions={"nopython": True, "nogil": True})
        self._kernels: dict[type, Any] = {}

    def add(self, kind: type, kernel: Any) -> None:
        """Choose a kernel where the first argument is of a class of named tuples."""
        self._kernels[kind] = kernel
        add_type_kernels(kind, kernel)

    def __call__(self, *args: Any) -> Any:
        """Call the one for the first argument."""
        return self._of(type(args[0]))(*args)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Tell a caller among the kernels what the one for the first argument returns."""
        return self._of(getattr(args[0], "instance_class", None)).get_call_template(args, kws)

    def get_overload(self, sig: Any) -> Any:
        """Find the code that a caller among the kernels links in."""
        return self._of(getattr(sig, "args", sig)[0].instance_class).get_overload(sig)

    def _of(self, kind: type | None) -> Any:
        if kind not in self._kernels:
            raise TypingError(f"no {self.py_func.__name__} is known for {kind}")
        return self._kernels[kind]
