"""Making data sets from simulators, training networks, export: not needed to plan or evaluate."""

from pushplan.learned.sb3_policy import specification_callback

__all__ = ["specification_callback"]
