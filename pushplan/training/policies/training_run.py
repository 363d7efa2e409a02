"""The folder of a training: configuration, checkpoint, learning curve, result."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import logging
import math
import time
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np

from pushplan.files.output_files import check_folder, replacing, write_atomic
from pushplan.files.safe_yaml import dump
from pushplan.imports.on_demand import need
from pushplan.training.policies.config import TrainingConfig, read_config
from pushplan.training.policies.environment import TrainingEnv
from pushplan.world import InvalidInputError

CONFIG = "config.yaml"
CURVE = "curve.csv"
PICTURE = "curve.png"
CHECKPOINT = "checkpoint.pt"
BEST = "best.pt"
POLICY = "policy.onnx"
RECORD = "training.json"
MODEL = "model.zip"
_ON_BOARD = ("train_return", "valid_return", "valid_share", "valid_success", "loss")
"""Columns of the learning curve that TensorBoard shows."""

log = logging.getLogger(__name__)

Until = Callable[[int], bool]
"""Asked with the number of chunks that are done; true leaves a training off."""


@dataclass(frozen=True)
class CurvePoint:
    """One row of a learning curve."""

    steps: int  # decisions so far
    seconds: float  # wall-clock time of training so far, without validation [s]
    episodes: int  # training episodes that ended in this chunk
    train_return: float  # mean unscaled reward of them; NaN where none ended
    train_success: float  # fraction of them that reached the goal
    valid_return: float  # mean unscaled reward of the validation episodes
    valid_success: float  # fraction of them that reached the goal
    valid_share: float  # mean fraction of their sub-tasks that were done
    loss: float  # of the learner, in its own units

    @property
    def rank(self) -> tuple[float, float]:
        """Rank of a policy in validation; the greater is better."""
        if math.isnan(self.valid_share):  # without validation the last one is taken
            return (0.0, 0.0)
        return (round(self.valid_share, 6), self.valid_return)


class TrainingRun:
    """A training in a folder; it can be left off after any chunk and taken up again.

    Args:
        folder: where everything is kept.
        config: what is trained. A folder that holds another training is refused.
        resume: go on with what is in the folder.

    Raises:
        InvalidInputError: if the folder holds a training and ``resume`` is false, or another one.
    """

    def __init__(self, folder: str | Path, config: TrainingConfig, *, resume: bool = False) -> None:
        self.folder = Path(folder)
        self.config = config
        self.curve: list[CurvePoint] = []
        there = self.folder / CONFIG
        if there.is_file():
            if not resume:
                raise InvalidInputError(
                    f"{self.folder} holds a training: go on with --resume, or take another folder"
                )
            _same(read_config(there), config, self.folder)
        check_folder(folder, "training", CONFIG)
        self.folder.mkdir(parents=True, exist_ok=True)
        write_atomic(there, dump(config.to_dict()).encode())
        if resume and self.path(CURVE).is_file():
            self.curve = _read_curve(self.path(CURVE))

    def abandon(self) -> None:
        """Leave the folder to another training, if nothing was learned in it."""
        if not self.curve:
            self.path(CONFIG).unlink(missing_ok=True)

    def path(self, name: str) -> Path:
        """A file of the run."""
        return self.folder / name

    @property
    def chunks(self) -> int:
        """Number of chunks of the training."""
        return -(-self.config.steps // self.config.chunk)

    @property
    def done(self) -> int:
        """Number of chunks that are done."""
        return len(self.curve)

    @property
    def seconds(self) -> float:
        """Wall-clock time of training so far [s]."""
        return self.curve[-1].seconds if self.curve else 0.0

    def save(self, state: Mapping[str, Any], point: CurvePoint) -> None:
        """Keep a checkpoint and the row of the curve that belongs to it; both or none count.

        Args:
            state: what `load` gives back: tensors, numbers, texts, lists and mappings of them.
            point: the new row.
        """
        torch = need("torch")
        best = point.rank >= max((old.rank for old in self.curve), default=(-np.inf, -np.inf))
        self.curve.append(point)
        state = {**state, "chunks": len(self.curve)}
        self._write_curve()  # rows beyond the checkpoint are dropped when it is loaded
        if best:
            with replacing(self.path(BEST)) as file:
                torch.save({"weights": state["weights"]}, file)
        with replacing(self.path(CHECKPOINT)) as file:
            torch.save(state, file)

    def load(self) -> Any:
        """The last checkpoint, None if there is none. Loads numbers only, never pickled code."""
        if not self.path(CHECKPOINT).is_file():
            self.curve = []
            return None
        state = self._numbers(CHECKPOINT)
        self.curve = self.curve[: int(state["chunks"])]
        if len(self.curve) != int(state["chunks"]):
            raise InvalidInputError(f"{self.path(CURVE)} does not belong to the checkpoint")
        return state

    def best_weights(self) -> Any:
        """Weights of the checkpoint that was best in validation."""
        return self._numbers(BEST)["weights"]

    def _numbers(self, name: str) -> Any:
        """A file of tensors, numbers and texts; anything else in it is refused."""
        torch = need("torch")
        try:
            return torch.load(self.path(name), map_location="cpu", weights_only=True)
        except Exception as error:  # damaged, or pickled code
            reason = str(error).strip().partition("\n")[0][:120]
            raise InvalidInputError(f"{self.path(name)} is no checkpoint: {reason}") from error

    def record(self, **facts: Any) -> None:
        """Write what a model card needs."""
        text = json.dumps({"config": self.config.to_dict(), **facts}, indent=2)
        write_atomic(self.path(RECORD), text.encode())

    def _write_curve(self) -> None:
        text = io.StringIO(newline="")
        writer = csv.DictWriter(text, [entry.name for entry in dataclasses.fields(CurvePoint)])
        writer.writeheader()
        for point in self.curve:
            row = vars(point).items()
            writer.writerow({k: v if isinstance(v, int) else f"{v:.6g}" for k, v in row})
        write_atomic(self.path(CURVE), text.getvalue().encode())


class Learned(NamedTuple):
    """Result of training in one chunk."""

    steps: int  # decisions or pairs so far
    loss: float
    returns: Sequence[float] = ()  # scaled rewards of the episodes that ended in the chunk
    successes: Sequence[float] = ()  # True for those of these episodes that reached the goal


class Learner(Protocol):
    """An algorithm, which `train` asks chunk by chunk."""

    progress: str  # logged after each chunk, with the row of the curve and ``total``

    @property
    def policy(self) -> Any:
        """The PyTorch module whose weights are the result."""

    def learn(self, steps: range, seed: int) -> Learned:
        """Learn from some of the training's decisions or pairs, with generators of that seed."""

    def decide(self, seen: Any) -> Any:
        """The action for an observation, as `validate` takes it."""

    def state(self) -> dict[str, Any]:
        """Beside the policy's weights, what `restore` needs: as `TrainingRun.save` takes it."""

    def restore(self, state: Any) -> None:
        """Go on from a checkpoint; the policy has its weights."""

    def close(self) -> None:
        """Close the environments."""


def chunk_seed(seed: int, chunk: int) -> int:
    """A seed for a chunk, far from those of its neighbours."""
    return zlib.crc32(f"{seed} {chunk}".encode()) % 2**31


def train(run: TrainingRun, learner: Learner, env: TrainingEnv, until: Until | None) -> None:
    """Train from the last checkpoint of a run to its end; the policy then has its best weights.

    Each chunk begins with fresh episodes and with generators seeded by the seed and the number of
    the chunk, so that a training that was left off ends with the same weights as one that was not
    (on the same machine and versions, on the processor).

    Args:
        run: the folder and the configuration.
        learner: what learns.
        env: in which the policy is validated.
        until: leaves the training off.
    """
    config = run.config
    state = run.load()
    if state is not None:
        try:
            learner.policy.load_state_dict(state["weights"])
            learner.restore(state)
        except (KeyError, RuntimeError, ValueError) as error:
            raise InvalidInputError(
                f"{run.path(CHECKPOINT)} is of another version: train anew in another folder"
            ) from error
    began = time.perf_counter() - run.seconds
    for chunk in range(run.done, run.chunks):
        if until is not None and until(chunk):
            break
        first = chunk * config.chunk
        steps = range(first, min(first + config.chunk, config.steps))
        learned = learner.learn(steps, chunk_seed(config.seed, chunk))
        paused = time.perf_counter()
        scores = validate(env, learner.decide, config.validation)
        began += time.perf_counter() - paused  # validation is no training
        point = CurvePoint(
            learned.steps,
            time.perf_counter() - began,
            len(learned.returns),
            _mean(learned.returns) / config.reward_scale,
            _mean(learned.successes),
            *scores,
            loss=learned.loss,
        )
        run.save({**learner.state(), "weights": learner.policy.state_dict()}, point)
        _show(run, point)
        log.info(learner.progress, {**vars(point), "total": config.steps})
    if run.done:
        learner.policy.load_state_dict(run.best_weights())


def _show(run: TrainingRun, point: CurvePoint) -> None:
    """Write a row of the curve for TensorBoard, where it is installed."""
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError:
        return
    with SummaryWriter(str(run.path("tb_0"))) as board:
        for name in _ON_BOARD:
            board.add_scalar(f"pushplan/{name}", getattr(point, name), point.steps)


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if values else float("nan")


def validate(
    env: TrainingEnv, decide: Callable[[Any], Any], episodes: int
) -> tuple[float, float, float]:
    """Mean unscaled return, success rate and fraction of sub-tasks done, over fixed starts.

    Args:
        env: of the training; its episode is lost.
        decide: from observation to action.
        episodes: how many; NaN where there is none.
    """
    returns = []
    successes = []
    fractions = []
    for number in range(episodes):
        seen, _ = env.reset(options={"layout": number})
        total = 0.0
        over = False
        while not over:
            seen, reward, terminated, truncated, info = env.step(decide(seen))
            total += reward / env.config.reward_scale
            over = terminated or truncated
        returns.append(total)
        successes.append(info["is_success"])
        fractions.append(info["share"])
    return _mean(returns), _mean(successes), _mean(fractions)


def _same(old: TrainingConfig, new: TrainingConfig, folder: Path) -> None:
    """A training may be made longer, nothing else."""
    before, after = ({**c.to_dict(), "steps": 0} for c in (old, new))
    for key, wanted in after.items():
        if before[key] != wanted:
            raise InvalidInputError(
                f"{folder} holds another training: its {key} is {before[key]!r}, not {wanted!r}"
            )


def _read_curve(path: Path) -> list[CurvePoint]:
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    whole = ("steps", "episodes")  # older files have 1e+06
    try:
        return [
            CurvePoint(**{k: int(float(v)) if k in whole else float(v) for k, v in row.items()})  # type: ignore[arg-type]
            for row in rows
        ]
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"{path} is no learning curve: {error}") from error
