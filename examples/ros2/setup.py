"""The ROS 2 package ``pushplan_nav2``, for ``colcon build``; pushplan itself comes from pip."""

from glob import glob

from setuptools import setup

NAME = "pushplan_nav2"
SHARE = f"share/{NAME}"

setup(
    name=NAME,
    version="0.3.0",
    packages=[],
    py_modules=[],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (SHARE, ["package.xml"]),
        (f"{SHARE}/launch", glob("launch/*.py")),
        (f"{SHARE}/config", glob("config/*.yaml")),
        (f"{SHARE}/behavior_trees", glob("behavior_trees/*.xml")),
        # a script with its modules beside it, as `python examples/ros2/node.py` runs it
        (f"lib/{NAME}", ["node.py", "navigator.py", "scene.py", "given_path.py"]),
    ],
)
