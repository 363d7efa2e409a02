"""Run trained networks as policies. ONNX Runtime is enough; no learning library is imported.

`load_policy("onnx:FILE")` gives a `pushplan.world.Policy`. What a file has to say about itself is a
`Specification`; `describe` makes it from an environment.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pushplan.imports.on_demand import lazy_names

if TYPE_CHECKING:
    from pushplan.learned.describing import describe
    from pushplan.learned.features import FeatureObservation
    from pushplan.learned.loading import LEARNED_PREFIXES, learned_names, load_policy
    from pushplan.learned.network_policy import NetworkPolicy
    from pushplan.learned.objects import ObjectPolicy
    from pushplan.learned.onnx_policy import OnnxPolicy
    from pushplan.learned.outputs import ActionSpec
    from pushplan.learned.sb3_policy import Sb3Policy, save_sb3
    from pushplan.learned.specification import RobotSpec, Specification

__all__ = [
    "LEARNED_PREFIXES",
    "ActionSpec",
    "FeatureObservation",
    "NetworkPolicy",
    "ObjectPolicy",
    "OnnxPolicy",
    "RobotSpec",
    "Sb3Policy",
    "Specification",
    "describe",
    "learned_names",
    "load_policy",
    "save_sb3",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "describing": "describe",
        "features": "FeatureObservation",
        "loading": "LEARNED_PREFIXES learned_names load_policy",
        "network_policy": "NetworkPolicy",
        "objects": "ObjectPolicy",
        "onnx_policy": "OnnxPolicy",
        "outputs": "ActionSpec",
        "sb3_policy": "Sb3Policy save_sb3",
        "specification": "RobotSpec Specification",
    },
)
