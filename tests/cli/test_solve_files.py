"""solve: tables with one pose a line, and files with any other content."""

import json
import math
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from robolink_cli import main
from robolink_cli.commands.measure.solve.answer import METHODS
from scipy.spatial.transform import Rotation

# solve --method: a table with one pose a line, columns and convention stated.

PIN, TIP = np.array([310.0, 95.0, -40.0]), np.array([4.2, -7.9, 131.6])
ANGLES = [(0, 0, 0), (40, 12, -8), (-75, -15, 10), (120, 9, 20), (-160, -18, -14), (80, 20, 5)]
ANGLES.append((20, -10, 16))
FLAT = "x,y,u\n297.5,98.25,0\n322.5,91.75,180\n306.75,82.5,90\n"


def rows(quaternions=False):
    for angles in ANGLES:
        turned = Rotation.from_euler("ZYX", angles, degrees=True)
        place = PIN - turned.as_matrix() @ TIP
        yield [*place, *(turned.as_quat() if quaternions else angles)]


def table(separator=",", header="", **how):
    lines = [separator.join(f"{value:.12g}" for value in row) for row in rows(**how)]
    return "\n".join([header, *lines]).lstrip("\n")


@pytest.fixture
def solved(tmp_path, capsys):
    def run(text, *arguments, encoding="utf-8"):
        path = tmp_path / "poses.csv"
        path.write_bytes(text.encode(encoding))
        code = main.run(["solve", str(path), *arguments, "--json"])
        return code, json.loads(capsys.readouterr().out)

    return run


@pytest.mark.parametrize("separator", [",", "; ", "\t", "   "])
def test_euler_angles_with_columns_in_the_first_line(solved, separator):
    text = table(separator, header=separator.join("xyzuvw"))
    code, answer = solved(text, "--method", "pivot")
    assert code == 0
    assert answer["offset"] == pytest.approx(TIP, abs=1e-6)
    assert answer["id"] == "poses.csv"


def test_quaternions_with_columns_named_by_option(solved):
    text = table("\t", quaternions=True)
    _, answer = solved(
        text, "--method", "pivot_robust", "--columns", "x,y,z,qx,qy,qz,qs", "--threshold", "0.1"
    )
    assert answer["offset"] == pytest.approx(TIP, abs=1e-6)
    assert answer["rejected"] == []


def test_a_sigma_gives_an_interval(solved):
    _, answer = solved(FLAT, "--method", "n_angle", "--sigma", "0.02", encoding="utf-8-sig")
    assert answer["offset"] == pytest.approx([12.5, -3.25])
    assert answer["sigma_stated"] is True
    assert answer["interval95"]["x_mm"][0] < 12.5


def test_a_word_for_a_number_is_named_by_pose_and_column(solved):
    code, answer = solved(FLAT.replace("91.75", "here"), "--method", "n_angle")
    assert (code, answer["error"]["code"]) == (7, "non_finite")
    assert "line 3: y is" in answer["error"]["what"]


@pytest.mark.parametrize(
    ("text", "arguments", "expected"),
    [
        ("1,20,30\n", (), "no line that names its 3 columns"),
        ("x,x,u\n1,2,30\n", (), "no line that names"),
        ("", (), "there is no pose in it"),
        ("x,y,u\n1,20\n", (), "line 2: "),
        ("1,20,30\n", ("--columns", "x,y,a"), "how a pose turns is not clear"),
        ("1 2 3 0 0 0 5\n", ("--columns", "x,y,z,qx,qy,qz,qs"), "the length 5"),
    ],
)
def test_another_layout_is_a_usage_error(solved, text, arguments, expected):
    code, answer = solved(text, "--method", "n_angle", *arguments)
    assert code == 2
    assert expected in answer["error"]["what"]


def test_a_file_that_is_no_text_is_a_usage_error(solved):
    code, answer = solved("x,y,\xfc\n", "--method", "n_angle", encoding="latin-1")
    assert (code, answer["error"]["kind"]) == (2, "ConfigError")


def test_two_poses_of_a_program_of_another_maker_are_solved(solved):
    text = "DECL POS XA={X 287.5,Y 103.25,Z -50,A 0,B 0,C 0}\n"
    text += "DECL POS XB={X 312.5,Y 96.75,Z -50,A 180,B 0,C 0}\n"
    _, answer = solved(text, "--method", "two_pose")
    assert answer["offset"][:2] == pytest.approx([12.5, -3.25])


def test_poses_of_another_tool_are_refused(solved):
    text = "x,y,u,tool\n287.5,103.25,0,3\n312.5,96.75,180,3\n"
    code, answer = solved(text, "--method", "two_pose")
    assert (code, answer["error"]["code"]) == (7, "tool_pose")


def test_the_options_of_a_table_need_a_method(solved):
    code, answer = solved("{}", "--sigma", "0.1")
    assert code == 2
    assert "--method" in answer["error"]["remedy"]


# Whatever a file contains, ``solve`` answers, refuses or names the slip; it never fails.

ODD: st.SearchStrategy[object] = st.sampled_from(
    [0, -1, 1, 2.5, 1e-9, 1e9, 1e11, 1e308, -0.0, True, None, "x", "", [], {}]
)
NUMBERS = st.one_of(ODD, st.floats(-400, 400), st.integers(-400, 400))
FUZZED_ANGLES = st.one_of(st.sampled_from([0, 90, 180, -90, 45, 360]), NUMBERS)
POSES = st.fixed_dictionaries(
    {"x": NUMBERS, "y": NUMBERS, "u": FUZZED_ANGLES},
    optional={
        "z": NUMBERS,
        "v": FUZZED_ANGLES,
        "w": FUZZED_ANGLES,
        "qs": NUMBERS,
        "tool": st.sampled_from([0, 1, 3, "1"]),
        "local": st.sampled_from([0, 2, -1]),
    },
)
PLACES = st.fixed_dictionaries({"x": NUMBERS, "y": NUMBERS}, optional={"z": NUMBERS})
SOUND = st.builds(
    lambda x, y, z, u, v, w: {"x": 300 + x, "y": y, "z": z, "u": u, "v": v, "w": w},
    *[st.integers(-20, 20)] * 3,
    *[st.sampled_from([0, 90, 180, -45])] * 2,
    st.sampled_from([0, 30, 180]),
)
"""A pose that a robot could take; lists of them reach the solver."""

VALUES = st.one_of(
    *(NUMBERS, POSES, PLACES),
    *(st.lists(POSES, max_size=9), st.lists(SOUND, max_size=9), st.lists(NUMBERS, max_size=5)),
)
ROWS = st.dictionaries(
    st.sampled_from(
        ["name", "u_mm", "u_deg", "lever_mm", "half_width_mm", "distribution", "dof", "alpha_per_K"]
    ),
    st.one_of(NUMBERS, st.just("rectangular")),
)
NAMES = (
    *("poses", "tools", "locals", "sigma_mm", "jog_grid_mm", "inlier_threshold", "seeds", "seed"),
    *("robot", "stored", "live", "min_delta_u_deg", "rows", "probability", "flange", "tip", "pin"),
)


def named(name: str) -> st.SearchStrategy[object]:
    known = {
        "poses": st.one_of(st.lists(SOUND, min_size=2, max_size=12), st.lists(POSES, max_size=4)),
        "rows": st.lists(ROWS, max_size=3),
        "tools": st.dictionaries(st.sampled_from(["1", "3", "x"]), PLACES, max_size=2),
        "locals": st.dictionaries(st.sampled_from(["2", ""]), PLACES, max_size=2),
        "robot": st.dictionaries(st.sampled_from(["reach_mm", "inner_mm", "kind"]), NUMBERS),
        "stored": PLACES,
        "live": POSES,
    }
    return st.one_of(known.get(name, VALUES), VALUES)


INPUTS = st.sets(st.sampled_from(NAMES), max_size=5).flatmap(
    lambda names: st.fixed_dictionaries({name: named(name) for name in sorted({*names, "poses"})})
)
CASES = st.fixed_dictionaries(
    {"method": st.sampled_from([*METHODS, "nothing"]), "input": st.one_of(INPUTS, ODD)}
)


def all_finite(value: object) -> bool:
    if isinstance(value, dict):
        return all(map(all_finite, value.values()))
    if isinstance(value, list):
        return all(map(all_finite, value))
    return not isinstance(value, float) or math.isfinite(value)


FILES = st.lists(CASES, min_size=1, max_size=6)
A_FEW = settings(
    max_examples=20,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)


@A_FEW
@given(FILES)
def test_any_file_is_answered(capsys, cases):
    check_answered(capsys, cases)


@pytest.mark.soak
@pytest.mark.timeout(600)
@settings(A_FEW, max_examples=1000)
@given(FILES)
def test_any_of_many_files_is_answered(capsys, cases):
    check_answered(capsys, cases)


def check_answered(capsys, cases):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "case.json"
        path.write_text(json.dumps({"vectors": cases}))
        code = main.run(["solve", str(path), "--json"])
        shown = json.loads(capsys.readouterr().out)
        assert code in (0, 7), shown
        assert len(shown["results"]) == len(cases)
        assert all_finite(shown)
        assert main.run(["solve", str(path)]) == code
        capsys.readouterr()
