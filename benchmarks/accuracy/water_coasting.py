"""How far ship and floes coast in open water at full scale; docs/tasks.md has some of it.

python -m benchmarks.accuracy.water_coasting
"""

from __future__ import annotations

import math

import numpy as np

from benchmarks.reporting import command_line
from pushplan.envs.tasks.ship_ice import ShipIceTask
from pushplan.world import GoalLine, Movables, StaticMap, World
from pushplan.world.checks import number

RADII = (6.0, 10.0, 25.0)
ENDS = (1.0, 0.5, 0.1)
SHIP = ShipIceTask(preset="full_scale")


def coasting(
    linear: float, quadratic: float, mass: float, start: float, end: float
) -> tuple[float, float]:
    """Time [s] and way [m] in which a free body slows down from one speed to another [m/s].

    The exact solution of ``mass dv/dt = -(linear + quadratic v) v``. Also holds about the vertical
    axis, with the moment of inertia for the mass and angles for ways.

    Raises:
        InvalidInputError: if a value is negative, or the speeds do not fall.
    """
    b = number("linear", linear, low=0.0)
    c = number("quadratic", quadratic, low=0.0)
    m = number("mass", mass, low=0.0, open_low=True)
    v1 = number("end speed", end, low=0.0, open_low=True)
    v0 = number("start speed", start, low=v1)
    if b == 0.0 and c == 0.0:
        return (0.0, 0.0) if v0 == v1 else (math.inf, math.inf)
    if c == 0.0:
        return m / b * math.log(v0 / v1), m / b * (v0 - v1)
    if b == 0.0:
        return m / c * (1.0 / v1 - 1.0 / v0), m / c * math.log(v0 / v1)
    slower = math.log((b + c * v0) / (b + c * v1))
    return m / b * (math.log(v0 / v1) - slower), m / c * slower


def main() -> None:
    command_line(__doc__).parse_args()
    angles = np.arange(8) * np.pi / 4.0
    octagon = np.stack([np.cos(angles), np.sin(angles)], axis=1) / np.sqrt(8.0**0.5 / np.pi)
    floes = [radius * octagon for radius in RADII]
    world = World(
        robot=SHIP.robot,
        robot_pose=np.zeros(3),
        static=StaticMap.build(bounds=SHIP.static.bounds),
        movables=Movables.from_outlines(
            floes, np.zeros((len(floes), 3)), density=SHIP.preset.floe_density
        ),
        goal=GoalLine(np.zeros(2), np.array([0.0, 1.0])),
    )
    water = SHIP.materials.water
    assert water is not None
    rows = zip(
        ("ship", *(f"floe of {radius:g} m radius" for radius in RADII)),
        (world.robot.mass, *world.movables.masses.tolist()),
        water.coefficients(world).tolist(),
        strict=True,
    )
    print("| body | mass | b | c | " + " | ".join(f"2 to {v:g} m/s" for v in ENDS) + " |")
    print("|---" * (4 + len(ENDS)) + "|")
    for name, mass, (b, c, _, _) in rows:
        cells = [f"{t:.0f} s, {x:.0f} m" for t, x in (coasting(b, c, mass, 2.0, v) for v in ENDS)]
        print(f"| {name} | {mass / 1e3:.0f} t | {b:.3g} | {c:.3g} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
