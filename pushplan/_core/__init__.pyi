"""The compiled core of pushplan (C++, see core/)."""

from pushplan._core import (
    control as control,
    envs as envs,
    geometry as geometry,
    gtsp as gtsp,
    interaction as interaction,
    motion as motion,
    observation as observation,
    perception as perception,
    planners as planners,
    pushing as pushing,
    rearrangement as rearrangement,
    scenarios as scenarios,
    search as search
)


SOURCES: str

COMPILER: str
