"""Tasks: how an episode starts, what counts, when it ends. None of them names an engine."""

from pushplan.envs.tasks.base import StepOutcome, Task

__all__ = ["StepOutcome", "Task"]
