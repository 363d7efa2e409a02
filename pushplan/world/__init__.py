"""The scene, the plan, the contracts between them, stop rules and seeds."""

from pushplan.errors import (
    InvalidInputError,
    MissingDependencyError,
    PushplanError,
    ScenarioError,
    SchemaError,
    UnknownNameError,
)
from pushplan.world.actions import Action, Twist, WheelSpeeds
from pushplan.world.goals import (
    AreaGoal,
    ClearanceArea,
    Goal,
    GoalDisc,
    GoalLine,
    GoalPose,
    ManipulationGoal,
    NavigationGoal,
    ObjectGoals,
    Receptacle,
)
from pushplan.world.movables import Movables
from pushplan.world.plan import Plan, PlanResult, PlanStats, PlanStatus, Stage, SubTask
from pushplan.world.policy_abilities import (
    ChecksEnvironment,
    ChecksScenario,
    ChoosesActions,
    ChoosesObservation,
    ExpectsNoise,
    HoldsDecisions,
    LogsPlans,
    PendingResult,
    PlanningExecutor,
    PlansBesideDriving,
    ShowsPlan,
)
from pushplan.world.price_map import PriceMap
from pushplan.world.protocols import Controller, Planner, Policy
from pushplan.world.robot import Drive, RobotModel
from pushplan.world.scene import World
from pushplan.world.seeds import stream
from pushplan.world.static_map import StaticMap
from pushplan.world.stop import (
    AnyOf,
    Cancellation,
    Deadline,
    FirstSolution,
    MaxIterations,
    OwnBudget,
    Stop,
    StopCheck,
)
from pushplan.world.stored.episode import Episode
from pushplan.world.stored.nav2_map import load_nav2_map
from pushplan.world.stored.robots import (
    BUMPERS,
    area_clearing_robot,
    box_delivery_robot,
    jackal,
    maze_robot,
    racecar,
    turtlebot3_burger,
)
from pushplan.world.stored.world_files import load_world, save_world, world_from_dict, world_to_dict
from pushplan.world.unseen import Unseen

__all__ = [
    "BUMPERS",
    "Action",
    "AnyOf",
    "AreaGoal",
    "Cancellation",
    "ChecksEnvironment",
    "ChecksScenario",
    "ChoosesActions",
    "ChoosesObservation",
    "ClearanceArea",
    "Controller",
    "Deadline",
    "Drive",
    "Episode",
    "ExpectsNoise",
    "FirstSolution",
    "Goal",
    "GoalDisc",
    "GoalLine",
    "GoalPose",
    "HoldsDecisions",
    "InvalidInputError",
    "LogsPlans",
    "ManipulationGoal",
    "MaxIterations",
    "MissingDependencyError",
    "Movables",
    "NavigationGoal",
    "ObjectGoals",
    "OwnBudget",
    "PendingResult",
    "Plan",
    "PlanResult",
    "PlanStats",
    "PlanStatus",
    "Planner",
    "PlanningExecutor",
    "PlansBesideDriving",
    "Policy",
    "PriceMap",
    "PushplanError",
    "Receptacle",
    "RobotModel",
    "ScenarioError",
    "SchemaError",
    "ShowsPlan",
    "Stage",
    "StaticMap",
    "Stop",
    "StopCheck",
    "SubTask",
    "Twist",
    "UnknownNameError",
    "Unseen",
    "WheelSpeeds",
    "World",
    "area_clearing_robot",
    "box_delivery_robot",
    "jackal",
    "load_nav2_map",
    "load_world",
    "maze_robot",
    "racecar",
    "save_world",
    "stream",
    "turtlebot3_burger",
    "world_from_dict",
    "world_to_dict",
]
