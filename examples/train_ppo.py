"""Train a network with Stable-Baselines3 on an environment of pushplan, and compare it.

``python examples/train_ppo.py`` trains for two minutes of processor time, too short to be good;
``python examples/train_ppo.py runs/ppo 200000`` takes what `maze-ppo` took. It needs
``pip install -e ".[train]"``. Afterwards the file is a policy like any other:

``pushplan bench maze-2d-3 --policies straight,sb3:runs/ppo/model.zip --trust-pickles``
"""

import sys
from pathlib import Path

import gymnasium
from stable_baselines3 import PPO

import pushplan.envs  # noqa: F401 - tells Gymnasium about the environments
from pushplan.cli import main
from pushplan.learned import FeatureObservation
from pushplan.training import specification_callback

out = Path(sys.argv[1] if sys.argv[1:] else "runs/ppo")
steps = int(sys.argv[2]) if sys.argv[2:] else 10_000
episodes = sys.argv[3] if sys.argv[3:] else "10"

env = gymnasium.make(
    "pushplan/Maze-v0", boxes=3, observation=FeatureObservation(), action="turn_rate"
)
env = gymnasium.wrappers.TransformReward(env, lambda reward: 0.01 * reward)

# 2**20: seeds from 0 on are the starts of suites, with which the result is compared
model = PPO("MlpPolicy", env, n_steps=1024, gamma=0.995, seed=2**20, device="cpu", verbose=1)
model.learn(steps, callback=specification_callback(out / "model.zip"))
model.save(out / "model.zip")  # model.pushplan.json is there already

policies = f"straight,sb3:{out / 'model.zip'}"
bench = ["bench", "maze-2d-3", "--policies", policies, "--episodes", episodes, "--trust-pickles"]
sys.exit(main([*bench, "--out", str(out / "bench")]))
