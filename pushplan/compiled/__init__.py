"""Compiled functions: the one decorator, its cache on disk, and how kernels are loaded ahead."""

from pushplan.compiled.by_type import KernelByType
from pushplan.compiled.dispatcher import cached_kernels, compiling_kernels, watching
from pushplan.compiled.kernel import copy_into, kernel, owned

__all__ = [
    "KernelByType",
    "cached_kernels",
    "compiling_kernels",
    "copy_into",
    "kernel",
    "owned",
    "watching",
]
