"""
The compiled core of pushplan (C++, see core/). Arguments are not checked.
"""

from _core import (
    envs as envs,
    geometry as geometry,
    gtsp as gtsp,
    interaction as interaction,
    learned as learned,
    motion as motion,
    observation as observation,
    planners as planners,
    scenarios as scenarios,
    search as search
)


SOURCES: str = '2ed70bbb722d'

COMPILER: str = 'GNU 12.2.0'
