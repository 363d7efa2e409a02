"""The ROS 2 package around the node: manifest, installation, launch file, behaviour tree."""

from __future__ import annotations

import runpy
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

import pytest
import yaml

import pushplan

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "examples" / "ros2"))
from navigator import PATH, PLANNERS

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "ros2"

PORTS = {
    "RecoveryNode": {"number_of_retries"},
    "PipelineSequence": set(),
    "RateController": {"hz"},
    "ComputePathToPose": {
        "goal", "start", "planner_id", "server_name", "server_timeout", "path", "error_code_id",
    },
    "FollowPath": {
        "path", "controller_id", "goal_checker_id", "progress_checker_id", "server_name",
        "server_timeout", "error_code_id",
    },
    "Sleep": {"msec"},
}  # fmt: skip
"""Ports of the nodes that the tree may use: Nav2's from `nav2_behavior_tree/nav2_tree_nodes.xml`
(ros-navigation/navigation2), those of Jazzy and later; `Sleep` is BehaviorTree.CPP's own."""


def test_the_behaviour_tree_uses_nodes_and_ports_that_nav2_has() -> None:
    root = ElementTree.parse(EXAMPLE / "behavior_trees" / "navigate_pushing.xml").getroot()
    assert root.tag == "root" and root.get("BTCPP_format") == "4"
    (tree,) = root
    assert tree.tag == "BehaviorTree" and tree.get("ID") == root.get("main_tree_to_execute")
    (top,) = tree
    nodes = {node.tag: node for node in top.iter()}
    for node in top.iter():
        assert set(node.attrib) - {"name"} <= PORTS[node.tag], node.tag
    assert {tag: len(node) for tag, node in nodes.items() if len(node)} == {
        "RecoveryNode": 2,
        "PipelineSequence": 2,
        "RateController": 1,
    }
    compute, follow = nodes["ComputePathToPose"], nodes["FollowPath"]
    assert compute.get("path") == follow.get("path") == "{path}"
    assert compute.get("goal") == "{goal}" and compute.get("planner_id") in PLANNERS
    assert follow.get("controller_id") in (PATH, *PLANNERS)


def test_the_manifest_is_one_of_format_3() -> None:
    """REP-149: which elements there are, in any order, and how often."""
    root = ElementTree.parse(EXAMPLE / "package.xml").getroot()
    assert root.tag == "package" and root.get("format") == "3"
    for once in ("name", "version", "description"):
        assert len(root.findall(once)) == 1
    assert root.findtext("version") == pushplan.__version__
    assert root.findtext("export/build_type") == "ament_python"
    assert all(person.get("email") for person in root.findall("maintainer"))
    assert root.findtext("license") == "MIT" and root.findall("maintainer")
    known = {"name", "version", "description", "maintainer", "license", "exec_depend", "export"}
    assert {child.tag for child in root} == known
    needs = {need.text for need in root.findall("exec_depend")}
    imported = {"rclpy", "geometry_msgs", "nav_msgs", "nav2_msgs", "visualization_msgs"}
    assert imported | {"launch", "launch_ros", "tf2_ros_py"} <= needs


def test_the_package_is_installed_where_ros_2_looks(tmp_path: Path) -> None:
    pytest.importorskip("setuptools")
    words = [sys.executable, "setup.py", "-q", "egg_info", "-e", str(tmp_path)]
    words += ["install_data", "-d", str(tmp_path)]
    made = subprocess.run(words, cwd=EXAMPLE, capture_output=True, text=True, check=False)
    assert made.returncode == 0, made.stderr
    share = tmp_path / "share" / "pushplan_nav2"
    assert (tmp_path / "share/ament_index/resource_index/packages/pushplan_nav2").is_file()
    assert (share / "package.xml").is_file() and (share / "config" / "pushplan.yaml").is_file()
    assert (share / "behavior_trees" / "navigate_pushing.xml").is_file()
    assert (share / "launch" / "pushing.launch.py").is_file()
    scripts = tmp_path / "lib" / "pushplan_nav2"
    assert (scripts / "node.py").stat().st_mode & 0o111  # else `ros2 run` does not see it
    assert {path.name for path in scripts.iterdir()} == {
        "node.py",
        "navigator.py",
        "scene.py",
        "given_path.py",
    }


class Described:
    """Stands for a class of `launch`: keeps what it is made with."""

    def __init__(self, *given: object, **named: object) -> None:
        self.given, self.named = given, named


def stand_in(name: str, *classes: str) -> ModuleType:
    module = ModuleType(name)
    for one in classes:
        setattr(module, one, type(one, (Described,), {}))
    return module


def test_the_launch_file_starts_what_the_lifecycle_manager_manages(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for module in (
        stand_in("launch", "LaunchDescription"),
        stand_in("launch.actions", "DeclareLaunchArgument"),
        stand_in("launch.substitutions", "LaunchConfiguration"),
        stand_in("launch_ros"),
        stand_in("launch_ros.actions", "LifecycleNode", "Node"),
    ):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    found = runpy.run_path(str(EXAMPLE / "launch" / "pushing.launch.py"))
    (actions,) = found["generate_launch_description"]().given
    kinds = [type(action).__name__ for action in actions]
    declared = {a.given[0] for a, k in zip(actions, kinds, strict=True) if k.startswith("Declare")}
    nodes = {a.named["name"]: a.named for a, k in zip(actions, kinds, strict=True) if "Node" in k}
    params = yaml.safe_load((EXAMPLE / "config" / "pushplan.yaml").read_text())
    assert set(params) == set(nodes)
    managed = params["lifecycle_manager_pushing"]["ros__parameters"]
    assert set(managed["node_names"]) == set(nodes) - {"lifecycle_manager_pushing"}
    assert managed["bond_timeout"] == 0.0
    pushing = nodes["pushplan"]
    assert pushing["executable"] == "node.py" and pushing["namespace"] == ""
    assert params["pushplan"]["ros__parameters"]["autostart"] is False
    used = {
        part.given[0]
        for node in nodes.values()
        for entry in node["parameters"]
        for part in ([entry] if isinstance(entry, Described) else entry.values())
        if isinstance(part, Described)
    }
    assert used == declared == {"robot", "params_file", "use_sim_time"}
    tree = nodes["bt_navigator"]["parameters"][1]["default_nav_to_pose_bt_xml"]
    assert Path(tree).is_file()


def test_parameters_of_the_configuration_are_those_of_the_node() -> None:
    source = (EXAMPLE / "node.py").read_text()
    table = source[source.index("PARAMETERS = {") :]
    names = {line.split('"')[1] for line in table[: table.index("}")].splitlines()[1:]}
    params = yaml.safe_load((EXAMPLE / "config" / "pushplan.yaml").read_text())
    assert set(params["pushplan"]["ros__parameters"]) <= names
    docs = (EXAMPLE.parents[1] / "docs" / "ros2.md").read_text()
    assert [name for name in sorted(names) if f"`{name}`" not in docs] == []
