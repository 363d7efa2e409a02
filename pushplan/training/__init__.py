"""Making data sets from simulators, training networks, export: not needed to plan or evaluate."""

from pushplan.training.specification_callback import specification_callback

__all__ = ["specification_callback"]
