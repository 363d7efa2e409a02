"""From what a robot's sensors report to a `pushplan.world.World`."""

from pushplan.perception.detector import Detections, Detector
from pushplan.perception.lidar import Lidar, LidarScan
from pushplan.perception.object_tracker import ObjectTracker
from pushplan.perception.scan_map import ScanMap
from pushplan.perception.world_estimate import WorldEstimate

__all__ = [
    "Detections",
    "Detector",
    "Lidar",
    "LidarScan",
    "ObjectTracker",
    "ScanMap",
    "WorldEstimate",
]
