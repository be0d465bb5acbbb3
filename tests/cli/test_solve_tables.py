"""solve --method: a table with one pose a line, columns and convention stated."""

import json

import numpy as np
import pytest
from robolink_cli import main
from scipy.spatial.transform import Rotation

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
