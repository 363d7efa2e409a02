"""``pushplan ice`` as a user meets it."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from pushplan.cli import main
from pushplan.scenarios import load_ice


def test_a_field_is_made_checked_and_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, again = tmp_path / "field.json", tmp_path / "field.npz"
    picture = tmp_path / "field.png"
    arguments = ["ice", "--concentration", "0.3", "--seed", "1", "--size", "12x20"]
    arguments += ["--keep-off", "0,0,12,2"]
    assert main([*arguments, "--out", str(out), "--picture", str(picture)]) == 0
    said = capsys.readouterr().out
    field = load_ice(out)
    assert said.startswith(f"{len(field)} floes, concentration 30.00 %\n")
    assert f"wrote {out}\n" in said
    assert field.bounds.tolist() == [0.0, 0.0, 12.0, 20.0]
    assert min(corners[:, 1].min() for (corners,) in field.floes) > 2.0
    assert Image.open(picture).size == (600, 1000)
    assert main(["ice", "--check", str(out), "--out", str(again)]) == 0
    assert load_ice(again) == field
    assert main([*arguments, "--out", str(again)]) == 0
    assert load_ice(again) == field


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ([], "needs --concentration, or --check"),
        (["--concentration", "30"], "ice concentration must lie in [0, 1], got 30"),
        (["--concentration", "0.99"], "cannot be packed"),
        (["--concentration", "0.3", "--radii", "0.6,0.2"], "ice radii must have"),
        (["--concentration", "0.3", "--out", "field.pkl"], "ends in .json or .npz"),
        (["--concentration", "0.3", "--picture", "field.bmp"], "a file to write ends in .png"),
        (["--check", "missing.json"], "cannot read ice field missing.json"),
        (["--check", "field.pkl"], "never from pickles"),
        (["--check", "field.json", "--concentration", "0.3"], "leave out --concentration"),
        (["--concentration", "0.3", "--overlaps"], "--hull and --overlaps go with a field"),
    ],
)
def test_one_line_says_what_is_wrong(
    arguments: list[str], text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["ice", *arguments]) == 2
    said = capsys.readouterr().err
    assert said.startswith("pushplan: ") and said.count("\n") == 1 and text in said


@pytest.mark.parametrize("size", ["12", "12xtwo", "1x2x3"])
def test_bad_sizes_are_bad_usage(size: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["ice", "--concentration", "0.3", "--size", size]) == 2
    assert "must be 2 numbers like 1x2" in capsys.readouterr().err


def test_help_has_examples(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["ice", "--help"]) == 0
    assert "examples:\n  pushplan ice" in capsys.readouterr().out


def test_floes_as_a_camera_sees_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    seen, clean = tmp_path / "seen.json", tmp_path / "clean.json"
    seen.write_text("[[[0,0],[2,0],[1,0.5],[2,2],[0,2]], [[1.9,0],[3,0],[3,2],[1.9,2],[1.9,0]]]")
    assert main(["ice", str(seen)]) == 0
    told = capsys.readouterr()
    assert told.err.startswith(
        "pushplan: note: floes overlapped in 1 places: 2 of 2 floes were moved"
    )
    assert told.err.count("\n") == 1 and told.out.startswith("2 floes")
    for given in ([str(seen)], ["--check", str(seen)]):
        assert main(["ice", *given, "--hull", "--overlaps", "--out", str(clean)]) == 0
        assert capsys.readouterr().out.startswith("2 floes, concentration 103.33 %")
    assert main(["ice", str(clean), "--overlaps"]) == 0
    assert load_ice(clean, overlaps=True) == load_ice(seen, hull=True, overlaps=True)
