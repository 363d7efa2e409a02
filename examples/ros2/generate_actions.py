r"""Make the Python package ``nav2_msgs`` with the two actions of the node, where Nav2 is missing.

    python3.12 -m venv ros && . ros/bin/activate
    pip install -e ".[ros]" catkin-pkg ros-jazzy-rclpy ros-jazzy-rmw-fastrtps-cpp \
        ros-jazzy-nav-msgs ros-jazzy-geometry-msgs ros-jazzy-visualization-msgs
    python examples/ros2/generate_actions.py

The wheels of ROS 2 Jazzy carry no ``nav2_msgs``, but the generators (``rosidl``), headers and
libraries that it is made of. This calls the generators, compiles what they write with gcc (3 s)
and puts it into the virtual environment. On a machine with Nav2 there is nothing to do.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

PACKAGE = "nav2_msgs"
SUPPORTS = ("c", "fastrtps_c", "introspection_c")
USED = (
    "action_msgs builtin_interfaces geometry_msgs nav_msgs service_msgs std_msgs "
    "unique_identifier_msgs"
).split()
RUNTIME = (
    "rosidl_runtime_c rosidl_typesupport_c rosidl_typesupport_fastrtps_c "
    "rosidl_typesupport_fastrtps_cpp rosidl_typesupport_introspection_c rcutils rmw fastcdr"
).split()
PREFIX = Path(sys.prefix)


def main() -> None:
    """Generate, compile, install."""
    os.environ.setdefault("AMENT_PREFIX_PATH", str(PREFIX))
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder)
        generate(made)
        build(made)
    print(f"made {PACKAGE} in {PREFIX}")


def generate(made: Path) -> None:
    """Write sources of the actions: folders ``py`` and those of the type supports."""
    from rosidl_cli import entry_points

    library = entry_points.importlib_metadata
    registered = library.entry_points()

    class Distinct:
        """The wheels register each generator twice, which ``rosidl`` refuses."""

        def select(self, group: str) -> list[Any]:
            return list({one.name: one for one in registered.select(group=group)}.values())

    library.entry_points = Distinct
    from rosidl_cli.command.generate.api import generate as rosidl_generate

    here = Path(__file__).parent
    rosidl_generate(
        package_name=PACKAGE,
        interface_files=[f"{here}:{p.relative_to(here)}" for p in sorted(here.glob("action/*"))],
        include_paths=[str(PREFIX / "share")],
        output_path=made,
        types=["c", "py"],
        typesupports=list(SUPPORTS),
    )


def build(made: Path) -> None:
    """Compile the sources and put the package into the virtual environment."""
    headers, library = made / "include", PREFIX / "lib"
    for support in SUPPORTS:
        shutil.copytree(made / support, headers / PACKAGE, dirs_exist_ok=True)
    include = [headers, np.get_include(), sysconfig.get_path("include"), PREFIX / "include"]
    include += [p for p in (PREFIX / "include").iterdir() if p.name != "python3.12"]
    flags = ["-w", "-O1", "-fPIC", *(f"-I{folder}" for folder in include)]
    kinds = ("rosidl_generator_c", *(f"rosidl_typesupport_{kind}" for kind in SUPPORTS))
    libraries = [f"-l{used}__{kind}" for used in USED for kind in kinds]
    libraries = [f"-L{library}", *libraries, *(f"-l{name}" for name in RUNTIME)]

    sources = [p for kind in SUPPORTS for p in sorted((made / kind / "action").rglob("*.c*"))]
    objects = [f"{source}.o" for source in sources]
    for source, compiled in zip(sources, objects, strict=True):
        compiler = "gcc" if source.suffix == ".c" else "g++"
        _run(compiler, "-c", *flags, str(source), "-o", compiled)
    name = f"{PACKAGE}__rosidl_typesupport_fastrtps_c"
    _run("g++", "-shared", *objects, *libraries, "-o", str(library / f"lib{name}.so"))
    other = library / f"lib{PACKAGE}__rosidl_typesupport_introspection_c.so"
    other.unlink(missing_ok=True)
    other.symlink_to(f"lib{name}.so")  # one library holds both, each is looked for by its name

    package = Path(sysconfig.get_path("purelib")) / PACKAGE
    shutil.copytree(made / "py", package, dirs_exist_ok=True)
    (package / "__init__.py").touch()
    sources = [*(package / "action").glob("*_s.c")]
    sources += [package / f"_{PACKAGE}_s.ep.rosidl_typesupport_c.c"]
    libraries = [f"-l{name}", *(f"-l{used}__rosidl_generator_py" for used in USED), *libraries]
    extension = package / f"{PACKAGE}_s__rosidl_typesupport_c.so"
    _run("gcc", "-shared", *flags, *map(str, sources), *libraries, "-o", str(extension))


def _run(*command: str) -> None:
    subprocess.run(command, check=True)


if __name__ == "__main__":
    main()
