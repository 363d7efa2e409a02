"""From what a robot's sensors report to a `pushplan.world.World`."""

from typing import TYPE_CHECKING

from pushplan.imports.on_demand import lazy_names

if TYPE_CHECKING:
    from pushplan.perception.detector import Detections, Detector
    from pushplan.perception.lidar import Lidar, LidarScan
    from pushplan.perception.lidar_observation import LidarObservation
    from pushplan.perception.movability import Movability
    from pushplan.perception.object_tracker import ObjectTracker
    from pushplan.perception.scan_map import ScanMap
    from pushplan.perception.world_estimate import WorldEstimate

__all__ = [
    "Detections",
    "Detector",
    "Lidar",
    "LidarObservation",
    "LidarScan",
    "Movability",
    "ObjectTracker",
    "ScanMap",
    "WorldEstimate",
]
__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "detector": "Detections Detector",
        "lidar": "Lidar LidarScan",
        "lidar_observation": "LidarObservation",
        "movability": "Movability",
        "object_tracker": "ObjectTracker",
        "scan_map": "ScanMap",
        "world_estimate": "WorldEstimate",
    },
)
