"""poses show: its reading of a file, and its questions to a person."""

import json

import pytest
from robolink_cli import main

FANUC = (
    "P[1:\"pin 1\"]{\n   GP1:\n\tUF : 0, UT : 3,\t\tCONFIG : 'N U T, 0, 0, 0',\n"
    "\tX =   405.800  mm,\tY =   -62.900  mm,\tZ =   251.600  mm,\n"
    "\tW =   180.000 deg,\tP =     0.000 deg,\tR =     0.000 deg\n};\n"
)
XYZRPW = "Name,X,Y,Z,R,P,W,Remark\nT 1,405.8,-62.9,251.6,-172,12,40,good\n"


@pytest.fixture
def shown(tmp_path, capsys):
    def run(text, *arguments, name="poses.txt"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        code = main.run(["poses", "show", str(path), *arguments])
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return run


def test_the_document_has_the_poses_and_how_they_were_read(shown):
    code, out, err = shown(FANUC, "--json")
    document = json.loads(out)
    assert (code, err, document["schema"]) == (0, "", "robolink/poses/1")
    (pose,) = document["poses"]
    assert pose == {
        "x_mm": 405.8,
        "y_mm": -62.9,
        "z_mm": 251.6,
        "u_deg": 0.0,
        "v_deg": 0.0,
        "w_deg": 180.0,
        "name": "pin 1",
        "number": 1,
        "local": 0,
        "tool": 3,
    }
    read_as = document["read_as"]
    assert (read_as["format"], read_as["length"], read_as["length_by"]) == ("FANUC", "mm", "file")
    assert read_as["rotation"] == "R = Rz(R) Ry(P) Rx(W)"


def test_the_document_is_a_file_of_poses_itself(shown):
    _, out, _ = shown(FANUC, "--json")
    code, again, _ = shown(out, "--json", name="again.json")
    assert code == 0
    assert json.loads(again)["poses"] == json.loads(out)["poses"]


def test_a_person_sees_a_table_and_how_it_was_read(shown):
    code, out, _ = shown(XYZRPW, "--euler", "xyzrpw")
    assert code == 0
    assert "T 1" in out
    assert "405.800" in out
    assert "1 poses read. Layout: table, utf-8." in out
    assert "Lengths were in mm (no rotation stated)." in out
    assert "R = Rz(W) Ry(P) Rx(R) deg" in out
    assert "Not used: Remark." in out


def test_poses_without_a_number_are_numbered_from_one(shown):
    _, out, _ = shown(XYZRPW, "--euler", "xyzrpw")
    assert [line.split()[:3] for line in out.splitlines() if "T 1" in line] == [["1", "T", "1"]]


@pytest.mark.parametrize(
    ("text", "option", "reason"),
    [
        (XYZRPW, "--euler", "euler"),
        ("1.5 20 -3 40\n", "--columns", "columns"),
        ("x,y,z,u\n0.3,0.1,-0.05,90\n", "--length", "length"),
    ],
)
def test_what_the_file_does_not_say_is_asked_with_the_option_that_says_it(
    shown, text, option, reason
):
    code, out, _ = shown(text, "--json")
    error = json.loads(out)["error"]
    assert (code, error["kind"], error["reason"]) == (2, "AmbiguousPosesError", reason)
    assert option in error["remedy"]
    code, _, err = shown(text)
    assert code == 2
    assert option in err


def test_the_options_say_what_the_file_does_not(shown):
    _, out, _ = shown("1.5 20 -3 40\n", "--columns", "x,y,z,u", "--length", "in", "--json")
    (pose,) = json.loads(out)["poses"]
    assert [pose[key] for key in ("x_mm", "u_deg")] == pytest.approx([38.1, 40.0])


def test_options_of_a_file_need_a_file(capsys):
    code = main.run(["calibrate", "two-pose", "--tool", "1", "--pose", "1,2,3", "--length", "m"])
    assert code == 2
    assert "need a file of poses" in capsys.readouterr().err


def test_a_calibration_takes_the_same_files(tmp_path, capsys):
    path = tmp_path / "touches.csv"
    path.write_text("X [m];Y [m];A;B;C\n0,2875;0,10325;0;0;0\n0,3125;0,09675;180;0;0\n", "utf-8")
    command = ["calibrate", "two-pose", "--tool", "1", "--poses", str(path), "--dry-run", "--json"]
    url = ["-c", f"epson+sim://{tmp_path.name}?robot=T6-602S&seed=1"]
    assert main.run([*url, *command]) == 2
    assert "--euler" in json.loads(capsys.readouterr().out)["error"]["remedy"]
    assert main.run([*url, *command, "--euler", "kuka"]) == 0
    proposed = json.loads(capsys.readouterr().out)["proposed"]
    assert (proposed["x_mm"], proposed["y_mm"]) == pytest.approx((12.5, -3.25))
