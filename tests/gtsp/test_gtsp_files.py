"""GTSPLIB files: what is read, what is written, what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from pushplan.cli import main
from pushplan.gtsp import (
    GtspConfig,
    GtspInstance,
    distances,
    read_gtsp,
    read_tour,
    solve_gtsp,
    write_gtsp,
    write_tour,
)
from pushplan.world import InvalidInputError, MaxIterations, SchemaError

CLUSTERS = ((0, 2), (1,), (3,))
HEAD = "NAME: small\nTYPE: AGTSP\nDIMENSION: 4\nGTSP_SETS: 3\n"
SETS = "GTSP_SET_SECTION\n1 1 3 -1\n2 2 -1\n3 4 -1\nEOF\n"
FULL = [[0, 1, 2, 4], [1, 0, 3, 5], [2, 3, 0, 6], [4, 5, 6, 0]]
LAYOUTS = {
    "FULL_MATRIX": "0 1 2 4 1 0 3 5\n2 3 0 6 4 5 6 0",
    "UPPER_ROW": "1 2 4\n3 5\n6",
    "UPPER_DIAG_ROW": "0 1 2 4 0 3 5 0 6 0",
    "LOWER_ROW": "1 2 3 4 5 6",
    "LOWER_DIAG_ROW": "0\n1 0\n2 3 0\n4 5 6 0",
    "UPPER_COL": "1 2 3 4 5 6",
    "UPPER_DIAG_COL": "0 1 0 2 3 0 4 5 6 0",
    "LOWER_COL": "1 2 4 3 5 6",
    "LOWER_DIAG_COL": "0 1 2 4 0 3 5 0 6 0",
}


def explicit(layout: str, data: str) -> str:
    return (
        f"{HEAD}EDGE_WEIGHT_TYPE: EXPLICIT\nEDGE_WEIGHT_FORMAT: {layout}\n"
        f"EDGE_WEIGHT_SECTION\n{data}\n{SETS}"
    )


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "small.gtsp"
    path.write_text(text)
    return path


@pytest.mark.parametrize("layout", sorted(LAYOUTS))
def test_matrix_layouts(tmp_path: Path, layout: str) -> None:
    instance = read_gtsp(written(tmp_path, explicit(layout, LAYOUTS[layout])))
    assert instance.costs.tolist() == FULL
    assert instance.clusters == CLUSTERS
    assert instance.name == "small"


@pytest.mark.parametrize(
    ("kind", "points", "distance"),
    [
        ("EUC_2D", [(0, 0), (3, 4.4)], 5),
        ("CEIL_2D", [(0, 0), (3, 4.01)], 6),
        ("MAN_2D", [(0, 0), (3, -4.4)], 7),
        ("MAX_2D", [(0, 0), (3, -4.6)], 5),
        ("ATT", [(0, 0), (10, 0)], 4),  # sqrt(10) = 3.16 is rounded up
        ("GEO", [(38.24, 20.42), (39.57, 26.15)], 509),  # ulysses16, Ithaca to Troy
    ],
)
def test_coordinates(kind: str, points: list[tuple[float, float]], distance: int) -> None:
    instance = GtspInstance.from_coordinates("two", points, [[0], [1]], kind)
    assert instance.costs.tolist() == [[0, distance], [distance, 0]]


def test_round_trip_of_any_float(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    costs = 10.0 ** rng.uniform(-9, 9, (4, 4)) * rng.choice([-1, 1], (4, 4))
    costs[0, 3] = np.inf
    for name, value in (("a", costs), ("b", np.array(FULL, dtype=float))):
        instance = GtspInstance(name, value, CLUSTERS, comment="of a test: with a colon")
        write_gtsp(tmp_path / name, instance)
        assert read_gtsp(tmp_path / name) == instance
    places = GtspInstance.from_coordinates("c", rng.normal(0, 50, (4, 2)), CLUSTERS, "CEIL_2D")
    write_gtsp(tmp_path / "c", places)
    assert read_gtsp(tmp_path / "c") == places


def test_a_file_cut_anywhere_is_one_clear_error(tmp_path: Path) -> None:
    text = explicit("FULL_MATRIX", LAYOUTS["FULL_MATRIX"])
    complete = text.index("\nEOF")
    for length in range(complete):
        with pytest.raises(SchemaError, match=r"small\.gtsp"):
            read_gtsp(written(tmp_path, text[:length]))
    assert read_gtsp(written(tmp_path, text[:complete])).clusters == CLUSTERS


def test_marks_of_other_systems(tmp_path: Path) -> None:
    text = "\ufeff" + explicit("FULL_MATRIX", LAYOUTS["FULL_MATRIX"]).replace("\n", "\r\n")
    path = tmp_path / "small.gtsp"
    path.write_bytes(text.encode())
    assert read_gtsp(path).costs.tolist() == FULL


def test_round_trip_of_tours(tmp_path: Path) -> None:
    write_tour(tmp_path / "tour", (4, 0, 2), name="three")
    assert read_tour(tmp_path / "tour") == (4, 0, 2)


@pytest.mark.parametrize(
    ("old", "new", "rule"),
    [
        ("AGTSP", "CVRP", "line 2: unknown TYPE 'CVRP'"),
        ("DIMENSION: 4", "DIMENSION: x", "line 3: DIMENSION must be a whole number from 1"),
        ("DIMENSION: 4", "DIMENSION: 999999999999", "from 1 to 12000, got '999999999999'"),
        ("DIMENSION: 4", "DIMENSION: 5", "DIMENSION|FULL_MATRIX of 5|node 5 is in none"),
        ("SETS: 3", "SETS: " + "9" * 5000, "line 4: GTSP_SETS must be a whole number from 1 to 4"),
        ("1 1 3 -1", "1 1 " + "9" * 5000, "line 11: '9{39}.* is not a whole number"),
        ("DIMENSION: 4\n", "", "the keyword DIMENSION is missing"),
        ("DIMENSION: 4", "DIMENSIONS: 4", "line 3: unknown keyword.*did you mean 'DIMENSION'"),
        ("EXPLICIT", "EUC_3D", "line 5: unknown EDGE_WEIGHT_TYPE"),
        ("FULL_MATRIX", "FUNCTION", "line 6: unknown EDGE_WEIGHT_FORMAT"),
        ("4 5 6 0", "4 5 6", "line 7: FULL_MATRIX of 4 nodes has 16 numbers, got 15"),
        ("4 5 6 0", "4 5 x 0", "line 9: 'x' is not a number"),
        ("4 5 6 0", "4 5 nan 0", "line 9: 'nan' is not a number"),
        ("4 5 6 0", "4 5 -inf 0", "-inf from node 3 to node 2"),
        ("1 1 3 -1", "1 1 3", "line 12: node 2 is in set 1|line 12"),
        ("1 1 3 -1", "1 1 9 -1", "line 11: nodes are 1 to 4, got 9"),
        ("2 2 -1", "2 3 -1", "line 12: node 3 is in set 1 already"),
        ("1 1 3 -1", "1 1 -1", "node 3 is in none"),
        ("2 2 -1", "3 2 -1", "line 13: set 3 stands here a second time"),
        ("2 2 -1", "2 -1", "line 12: set 2 has no node"),
        ("3 4 -1\n", "", "expected 3 sets, got 2"),
        ("NAME: small", "5 6 7", "line 1: data outside of a section"),
        ("TYPE: AGTSP", "NAME: again", "line 2: NAME stands here a second time"),
        ("GTSP_SET_SECTION\n1 1 3 -1\n2 2 -1\n3 4 -1\n", "", "GTSP_SET_SECTION is missing"),
    ],
)
def test_errors_name_file_line_and_rule(tmp_path: Path, old: str, new: str, rule: str) -> None:
    text = explicit("FULL_MATRIX", LAYOUTS["FULL_MATRIX"])
    assert old in text
    path = written(tmp_path, text.replace(old, new, 1))
    with pytest.raises(SchemaError, match=rule) as error:
        read_gtsp(path)
    assert str(path) in str(error.value)


@pytest.mark.parametrize(
    ("data", "rule"),
    [
        ("1 2\n-1\n", "expected 3 nodes, as DIMENSION says, got 2"),
        ("1 2 2 -1\n", "line 4: node 2 is visited twice"),
        ("0 1 2 -1\n", "line 4: nodes are numbered from 1, got 0"),
        ("1 2 3 -1 4\n", "line 4: expected nothing after -1"),
        ("", "the tour has no node"),
    ],
)
def test_bad_tours(tmp_path: Path, data: str, rule: str) -> None:
    path = written(tmp_path, f"TYPE: TOUR\nDIMENSION: 3\nTOUR_SECTION\n{data}")
    with pytest.raises(SchemaError, match=rule):
        read_tour(path)


def test_files_that_are_not_there(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="cannot read"):
        read_gtsp(tmp_path / "none.gtsp")
    with pytest.raises(InvalidInputError, match="cannot write"):
        write_tour(tmp_path / "none" / "tour", (0,))
    (tmp_path / "bytes.gtsp").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InvalidInputError, match="line 1: data outside of a section"):
        read_gtsp(tmp_path / "bytes.gtsp")


def test_command_writes_a_tour(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, explicit("FULL_MATRIX", LAYOUTS["FULL_MATRIX"]))
    out = tmp_path / "small.gtsp-tour"
    assert main(["gtsp", str(path), "--iterations", "10", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["status"] == "optimal" and sorted(found["nodes"]) == [1, 2, 4]
    assert main(["gtsp", str(path), "--iterations", "10", "--out", str(out)]) == 0
    assert "optimal, cost 10, lower bound 10" in capsys.readouterr().out
    assert sorted(read_tour(out)) == [0, 1, 3]
    begin = ["gtsp", str(path), "--initial", str(out), "--fixed-start"]
    assert main([*begin, str(read_tour(out)[1] + 1)]) == 0
    assert "optimal, cost 10" in capsys.readouterr().out
    assert main([*begin, "9"]) == 2
    assert "--fixed-start has node 9, but nodes are 1 to 4" in capsys.readouterr().err
    assert main(["gtsp", str(tmp_path / "none.gtsp")]) == 2
    assert "cannot read" in capsys.readouterr().err


def test_command_says_why_there_is_no_tour(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = "0 1 2 inf 1 0 3 inf\n2 3 0 inf 4 5 6 0"
    path = written(tmp_path, explicit("FULL_MATRIX", data))
    assert main(["gtsp", str(path)]) == 1
    assert "infeasible: No tour visits every cluster" in capsys.readouterr().out


AS_OTHERS_WRITE = {
    "an author after the type": ("TYPE: AGTSP", "TYPE : TSP (M.~Hofmeister)"),
    "sets in any order": ("1 1 3 -1\n2 2 -1\n3 4 -1\n", "3 4 -1\n1 1 3 -1\n2 2 -1\n"),
    "comment lines": ("DIMENSION: 4", "# by hand: 4 nodes\n#CAPACITY 3\nDIMENSION: 4"),
    "keywords that do not matter": (
        "DIMENSION: 4",
        "CAPACITY: 3\nEDGE_DATA_FORMAT : EDGE_LIST\nBEST_KNOWN: 12\nDIMENSION:4",
    ),
    "sections that do not matter": ("GTSP_SET_SECTION", "DEPOT_SECTION\n1\n-1\nGTSP_SET_SECTION"),
}


@pytest.mark.parametrize("how", AS_OTHERS_WRITE)
def test_files_as_others_write_them(tmp_path: Path, how: str) -> None:
    text = explicit("FULL_MATRIX", LAYOUTS["FULL_MATRIX"])
    assert AS_OTHERS_WRITE[how][0] in text
    instance = read_gtsp(written(tmp_path, text.replace(*AS_OTHERS_WRITE[how], 1)))
    assert instance.costs.tolist() == FULL and instance.clusters == CLUSTERS


def test_a_name_in_another_code_is_read(tmp_path: Path) -> None:
    path = tmp_path / "old.gtsp"
    text = explicit("FULL_MATRIX", LAYOUTS["FULL_MATRIX"]).replace("small", "Zürich")
    path.write_bytes(text.encode("latin-1"))
    assert read_gtsp(path).name == "Z\ufffdrich"


def test_the_short_form_of_glns(tmp_path: Path) -> None:
    text = "N: 4\nM: 3\nSymmetric: true\nTriangle: false\n2 2\n1 1 3\n3 4\n"
    matrix = "\n".join(" ".join(map(str, row)) for row in FULL)
    instance = read_gtsp(written(tmp_path, text + matrix + "\n"))
    assert instance.costs.tolist() == FULL and instance.clusters == CLUSTERS
    for broken, rule in (
        (text, "FULL_MATRIX of 4 nodes has 16 numbers, got 0"),
        (text.replace("M: 3", "M: 2") + matrix, "sets|numbers|node 4 is in none"),
        (text.replace("N: 4", "N: x") + matrix, "DIMENSION must be a whole number"),
        ("N: 4\nM: 3\n", "the section N is missing"),
    ):
        with pytest.raises(SchemaError, match=rule):
            read_gtsp(written(tmp_path, broken))


def test_keywords_that_are_nearly_right_are_named(tmp_path: Path) -> None:
    text = explicit("FULL_MATRIX", LAYOUTS["FULL_MATRIX"]).replace("DIMENSION", "DIMENSON")
    with pytest.raises(SchemaError, match="line 3: unknown keyword 'DIMENSON'; did you mean"):
        read_gtsp(written(tmp_path, text))


def test_more_nodes_than_memory_holds_are_refused_before_it_is_taken(tmp_path: Path) -> None:
    points = "\n".join(f"{i} {i} 0" for i in range(1, 20_001))
    text = HEAD.replace("4", "20000") + f"EDGE_WEIGHT_TYPE: EUC_2D\nNODE_COORD_SECTION\n{points}\n"
    with pytest.raises(SchemaError, match="DIMENSION must be a whole number from 1 to 12000"):
        read_gtsp(written(tmp_path, text + SETS))
    with pytest.raises(InvalidInputError, match="the number of nodes must be in"):
        GtspInstance.from_coordinates("many", np.zeros((20_000, 2)), [range(20_000)])


def test_distances_are_made_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    points = np.random.default_rng(0).uniform(-90.0, 90.0, (50, 2))
    for kind in distances.COORDINATE_TYPES:
        monkeypatch.setattr(distances, "_ROWS", 1000)
        whole = distances.distances(points, kind)
        monkeypatch.setattr(distances, "_ROWS", 7)
        assert distances.distances(points, kind).tobytes() == whole.tobytes()


@pytest.mark.parametrize("method", ["auto", "exact"])
def test_a_thousand_clusters_and_more(method: str) -> None:
    count = 1100
    at = np.arange(count)
    costs = np.abs(at[:, None] - at).astype(float)
    config, stop = GtspConfig(method=method), MaxIterations(1)
    if method == "exact":
        with pytest.raises(InvalidInputError, match=r"table of .* MB for 1100 clusters"):
            solve_gtsp(costs, at[:, None], stop=stop, config=config)
    else:
        tour = solve_gtsp(costs, at[:, None], stop=stop, config=config)
        assert sorted(tour.nodes) == at.tolist()
