"""The folder of a training: configuration, checkpoint, learning curve, result."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from pushplan.training.policies.config import TrainingConfig, read_config
from pushplan.training.policies.environment import TrainingEnv
from pushplan.world import InvalidInputError
from pushplan.world.libraries import need
from pushplan.world.output_files import check_folder, replacing, write_atomic
from pushplan.world.safe_yaml import dump

CONFIG, CURVE, PICTURE = "config.yaml", "curve.csv", "curve.png"
CHECKPOINT, BEST, POLICY, RECORD = "checkpoint.pt", "best.pt", "policy.onnx", "training.json"


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
        """What makes one policy better than another in validation."""
        if math.isnan(self.valid_share):  # without validation the last one is taken
            return (0.0, 0.0)
        return (round(self.valid_share, 6), self.valid_return)


class TrainingRun:
    """A training in a folder; it can be left off after any chunk and taken up again.

    Args:
        folder: where everything is kept.
        config: what is trained. A folder that holds another training is refused.
        resume: whether to go on with what is in the folder.

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
        """How many chunks the training has."""
        return -(-self.config.steps // self.config.chunk)

    @property
    def done(self) -> int:
        """How many of them are done."""
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
        names = [entry.name for entry in dataclasses.fields(CurvePoint)]
        text = io.StringIO(newline="")
        writer = csv.writer(text)
        writer.writerow(names)
        for point in self.curve:
            values = dataclasses.astuple(point)
            writer.writerow([v if isinstance(v, int) else f"{v:.6g}" for v in values])
        write_atomic(self.path(CURVE), text.getvalue().encode())


class Learned(NamedTuple):
    """What came of the training in one chunk."""

    steps: int  # decisions or pairs so far
    loss: float
    returns: Sequence[float] = ()  # scaled rewards of the episodes that ended in the chunk
    successes: Sequence[float] = ()  # whether these episodes reached the goal


def train_chunks(
    run: TrainingRun,
    env: TrainingEnv,
    until: Until | None,
    *,
    learn: Callable[[int], Learned],
    decide: Callable[[Any], Any],
    state: Callable[[], Mapping[str, Any]],
) -> Iterator[CurvePoint]:
    """Train chunk by chunk, from the last checkpoint of a run to its end.

    Args:
        run: the folder and the configuration.
        env: in which the policy is validated.
        until: leaves the training off.
        learn: trains for the chunk of this number.
        decide: from observation to action, as `validate` takes it.
        state: what `TrainingRun.save` keeps.

    Yields:
        The row of the curve of each chunk, after its checkpoint was written.
    """
    began = time.perf_counter() - run.seconds
    for chunk in range(run.done, run.chunks):
        if until is not None and until(chunk):
            break
        learned = learn(chunk)
        paused = time.perf_counter()
        scores = validate(env, decide, run.config.validation)
        began += time.perf_counter() - paused  # validation is no training
        point = CurvePoint(
            learned.steps,
            time.perf_counter() - began,
            len(learned.returns),
            _mean(learned.returns) / run.config.reward_scale,
            _mean(learned.successes),
            *scores,
            loss=learned.loss,
        )
        run.save(state(), point)
        yield point


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
    returns, successes, fractions = [], [], []
    for number in range(episodes):
        seen, _ = env.reset(options={"layout": number})
        total, over = 0.0, False
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
    differing = [key for key in after if before[key] != after[key]]
    if differing:
        key = differing[0]
        raise InvalidInputError(
            f"{folder} holds another training: its {key} is {before[key]!r}, not {after[key]!r}"
        )


def _read_curve(path: Path) -> list[CurvePoint]:
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    whole = ("steps", "episodes")  # older files have 1e+06
    try:
        numbers = [{name: float(text) for name, text in row.items()} for row in rows]
        return [
            CurvePoint(**{k: int(v) if k in whole else v for k, v in row.items()})  # type: ignore[arg-type]
            for row in numbers
        ]
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"{path} is no learning curve: {error}") from error
