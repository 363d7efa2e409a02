"""Compiled functions: the one decorator, its cache on disk, and how kernels are loaded ahead."""

from pushplan.compiled.dispatcher import watching
from pushplan.compiled.fingerprint import add_type_kernels
from pushplan.compiled.kernel import copy_into, kernel

__all__ = ["add_type_kernels", "copy_into", "kernel", "watching"]
