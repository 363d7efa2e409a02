from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

from pushplan.cli import main
from pushplan.learned import FeatureObservation, Specification
from pushplan.learned.sb3_policy import Sb3Policy, UntrustedError


def test_it_prints_a_specification(capsys: pytest.CaptureFixture[str]) -> None:
    call = ["describe", "maze-2d-3", "--observation", "features", "--action", "velocity"]
    assert main([*call, "--repeat", "3"]) == 0
    found = Specification.from_json(capsys.readouterr().out)
    assert found.observation == FeatureObservation() and found.tasks == ("maze",)
    assert (found.action.mode, found.action.repeat) == ("velocity", 3)


def test_it_makes_a_zip_from_elsewhere_a_policy(tmp_path: Path, monkeypatch) -> None:
    model = tmp_path / "model.zip"
    with zipfile.ZipFile(model, "w") as archive:
        archive.writestr("data", "{}")
    call = ["describe", "maze-2d-3", "--observation", "state", "--for", str(model)]
    assert main([*call, "--algorithm", "ppo"]) == 0
    assert (tmp_path / "model.pushplan.json").is_file()
    with pytest.raises(UntrustedError):  # everything but the trust is there
        Sb3Policy(model, trust=False)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--for", "model.zip"], "--for needs --algorithm, one of ppo, sac"),
        (["--for", "model.txt", "--algorithm", "ppo"], "ends in .zip"),
        (["--for", "no/model.zip", "--algorithm", "ppo"], "no folder"),
        (["--algorithm", "dqn"], "--algorithm"),
        (["--observation", "smell"], "smell"),
        (["--action", "fly"], "fly"),
    ],
)
def test_what_is_wrong_is_one_line(more, message, capsys) -> None:
    assert main(["describe", "maze-2d-3", *more]) == 2
    text = capsys.readouterr().err
    assert message in text and text.count("\n") == 1
