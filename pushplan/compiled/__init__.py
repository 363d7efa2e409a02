"""Compiled functions: the one decorator, its cache on disk, and how kernels are loaded ahead."""

from pushplan.compiled.kernel import copy_into, kernel

__all__ = ["copy_into", "kernel"]
