"""Kernels are counted; a total is said only where it is known."""

from pushplan.cli.kernel_progress import KernelProgress


def test_the_total_is_said_when_every_kernel_is_one_that_was_expected():
    progress = KernelProgress(frozenset("abc"))
    progress("a", True)
    progress("b", False)
    assert str(progress) == "compiling kernels, about 1 s at most, once: 2 of at most 3"
    assert (progress.loaded, progress.compiled) == (1, 1)


def test_no_total_is_said_when_none_is_known_or_it_is_wrong():
    progress = KernelProgress()
    progress("a", False)
    assert str(progress) == "compiling kernels, once: 1"
    progress = KernelProgress(frozenset("ab"))
    progress("c", False)
    assert str(progress) == "compiling kernels, once: 1"
