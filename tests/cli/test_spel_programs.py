"""spel check, spel run, and a program in a served controller, as typed commands."""

import io
import json
import os
import tty
from pathlib import Path
from types import SimpleNamespace

import pytest
from robolink_cli.commands.simulate.epson import ProjectSurroundings, load_programs
from robolink_simulators.epson import EpsonSimulator

from robolink.errors import ConfigError

GOOD = (
    'Function main\n  Print "one", 2\n  Wait 0.5\n  other\nFend\nFunction other\n  Print 3\nFend\n'
)


@pytest.fixture
def ended(run):
    """Return the exit code, stdout and stderr of a command."""

    def ran(*arguments):
        return SimpleNamespace(**dict(zip(("code", "out", "err"), run(*arguments), strict=True)))

    return ran


@pytest.fixture
def program(tmp_path):
    def write(text, name="main.prg"):
        path = tmp_path / name
        path.write_text(text)
        return str(path)

    return write


def test_check_tells_how_many_functions_there_are(ended, program):
    end = ended("spel", "check", program(GOOD), "--json")
    assert end.code == 0
    document = json.loads(end.out)
    assert document["functions"] == ["main", "other"]
    assert document["labels_known"] is False


def test_check_tells_every_fault_with_its_place(ended, program):
    path = program("Function main\nPrint (\nGoTo away\nFend\n")
    end = ended("spel", "check", path)
    assert end.code == 2
    assert "main.prg:2:8: the line ends too early (expected " in end.err
    assert "main.prg:3: error 3108" in end.err


def test_check_takes_all_files_as_one_project(ended, program):
    first = program("Function main\n  other\n  washpos\nFend\n")
    second = program("Function other\nFend\n", "two.prg")
    end = ended("spel", "check", first, second)
    assert end.code == 2
    assert "there is no statement and no function washpos" in end.err
    assert end.err.count("main.prg:") == 2  # in the list, and as the first


def test_run_prints_and_traces(ended, program):
    end = ended("spel", "run", program(GOOD), "--trace")
    assert end.code == 0
    assert end.out == "one 2\n3\n"
    steps = [line.split(": ", 1)[1] for line in end.err.splitlines() if "main.prg:" in line]
    assert steps == ['Print "one", 2', "Wait 0.5", "other", "Print 3", "Fend", "Fend"]


def test_run_leaves_a_program_that_goes_on(ended, program):
    path = program("Function main\nDo\nWait 1\nLoop\nFend\n")
    end = ended("spel", "run", path, "--for", "60", "--json")
    assert end.code == 0
    document = json.loads(end.out)
    assert document["ended"] is False
    assert 58 < document["simulated_s"] <= 60


def test_run_tells_where_a_program_failed(ended, program):
    end = ended("spel", "run", program("Function main\nGo P900\nFend\n"))
    assert end.code == 5
    assert "Error 7007 in main, main.prg:2" in end.err
    end = ended("spel", "run", program(GOOD), "--function", "nobody")
    assert end.code == 2
    assert "no function nobody" in end.err


def test_a_background_task_starts_the_program(ended, program):
    path = program(GOOD + "Function bg\n  Wait 1\n  StartMain main\nFend\n")
    end = ended("spel", "run", path, "--option", "background_tasks=bg")
    assert (end.code, end.out) == (0, "one 2\n3\n")
    both = ended("spel", "run", path, "--option", "background_tasks=bg", "--function", "main")
    assert both.out == "one 2\n3\none 2\n3\n"


def test_a_background_task_is_named_as_there_is_one(ended, program):
    end = ended("spel", "run", program(GOOD), "--option", "background_tasks=nobody")
    assert end.code == 2
    assert "nobody" in end.err
    alone = ended("sim", "epson", "--option", "background_tasks=bg")
    assert alone.code == 2
    assert "--option background_tasks" in alone.err


def test_points_alone_are_no_program(ended, program):
    end = ended("sim", "epson", "--tcp", "127.0.0.1:0", "--points", program("", "a.pts"))
    assert end.code == 2
    assert "--program" in end.err


def test_a_program_with_faults_is_not_served(ended, program):
    path = program("Function main\nPrint (\nFend\n")
    end = ended("sim", "epson", "--tcp", "127.0.0.1:0", "--program", path)
    assert end.code == 2
    assert "main.prg:2:8" in end.err


VISION = """
schema = "robolink/vision/1"
[[sequence]]
name = "findTip"
  [[sequence.object]]
  name = "tip"
"""


def test_run_takes_a_vision_project(ended, program):
    path = program("Function main\n  VRun findTip\n  Print 7\nFend\n")
    end = ended("spel", "run", path, "--vision", program(VISION, "vision.toml"))
    assert (end.code, end.out) == (0, "7\n")
    end = ended("spel", "run", path, "--vision", program(VISION + "x = 1\n", "vision.toml"))
    assert end.code == 2
    assert "sequence.1.object.1.x: is not known" in end.err
    assert ended("spel", "run", path).code == 5


def test_a_vision_project_goes_with_a_program(ended, program):
    end = ended("sim", "epson", "--tcp", "127.0.0.1:0", "--vision", program(VISION, "v.toml"))
    assert end.code == 2
    assert "--vision needs --program" in end.err


def test_run_reaches_the_serial_line_that_it_is_told(ended, program):
    path = program('Function main\n  OpenCom #1\n  Print #1, "to the line"\nFend\n')
    far, near = os.openpty()
    try:
        tty.setraw(near)
        end = ended("spel", "run", path, "--com", f"1={os.ttyname(near)}")
        assert (end.code, os.read(far, 100)) == (0, b"to the line\r\n")
    finally:
        os.close(far)
        os.close(near)
    assert ended("spel", "run", path).code == 5
    end = ended("spel", "run", path, "--com", "9=/dev/pts/3")
    assert end.code == 2
    assert "1 to 4 or 1001 to 1008" in end.err


def test_run_writes_files_into_the_folder_that_it_is_told(ended, program, tmp_path):
    path = program('Function main\n  WOpen "log.txt" As #30\n  Print #30, 7\n  Close #30\nFend\n')
    (tmp_path / "data").mkdir()
    assert ended("spel", "run", path, "--files", str(tmp_path / "data")).code == 0
    assert (tmp_path / "data" / "c" / "log.txt").read_bytes() == b"7\r\n"
    assert not list(tmp_path.glob("log.txt"))


def test_run_hands_what_is_typed_to_input(ended, program, monkeypatch):
    path = program("Function main\n  Integer n\n  Input n\n  Print 2 * n\n  Input n\nFend\n")
    monkeypatch.setattr("sys.stdin", io.StringIO("21\n"))
    end = ended("spel", "run", path)
    assert (end.code, end.out) == (5, "?\n42\n?\n")
    assert "Error 2505 in main" in end.err


@pytest.mark.parametrize("option", ["--com", "--files"])
def test_what_goes_with_a_program_is_refused_without_one(ended, option, tmp_path):
    value = {"--com": "1=/dev/pts/3", "--files": str(tmp_path)}[option]
    end = ended("sim", "epson", "--tcp", "127.0.0.1:0", option, value)
    assert end.code == 2
    assert f"{option} needs --program" in end.err


def test_a_served_program_has_the_line_and_the_folder_that_were_named(tmp_path, program):
    simulator = EpsonSimulator()
    surroundings = ProjectSurroundings(lines=["2=/dev/pts/9"], folder=tmp_path)
    runner = surroundings.load(simulator, [Path(program(GOOD))], [])
    assert runner.ports.devices == {2: "/dev/pts/9"}
    assert runner.session.files.root == tmp_path


POINT = """ENVT0100
Point1 {
\tnNumber=1
\tsLabel="LABEL"
\tnUndefined=0
\trX=250
\trY=NUMBER
\trZ=-5
\trU=0
\tnLocal=0
\tnHand=1
}
"""
PROJECT = """ENVT0100
ProgramFile1 {
\tsName="Main.prg"
}
nPointFileCount=2
PointFile1 {
\tsName="other.pts"
\tnRobot=1
\tbDefault=False
}
PointFile2 {
\tsName="robot1.pts"
\tnRobot=1
\tbDefault=True
}
"""


@pytest.fixture
def project(tmp_path, program):
    """Return a project file with a program beside it that it does not list."""
    program(POINT.replace("LABEL", "tray").replace("NUMBER", "100"), "robot1.pts")
    program(POINT.replace("LABEL", "bin").replace("NUMBER", "-100"), "other.pts")
    program("Function main\n  Nonsense (\nFend\n", "old_main.prg")
    program('Function main\n  Print CY(tray)\n  LoadPoints "other.pts"\n  Print CY(bin)\nFend\n')
    return program(PROJECT, "cell.sprj")


def test_a_project_file_stands_for_the_files_that_it_lists(ended, project):
    end = ended("spel", "check", project, "--json")
    assert end.code == 0
    document = json.loads(end.out)
    assert [Path(name).name for name in document["files"]] == ["main.prg"]
    assert document["labels_known"] is True
    assert ended("spel", "run", project).out == "100\n-100\n"


def test_a_project_file_is_refused_by_what_is_wrong_with_it(ended, program, project):
    both = ended("spel", "check", project, project.replace("cell.sprj", "main.prg"))
    assert both.code == 2
    assert "no other file goes with it" in both.err
    missing = program(PROJECT.replace("Main.prg", "gone.prg"), "missing.sprj")
    assert "gone.prg, which is not beside it" in ended("spel", "check", missing).err
    points = program(PROJECT.replace("other.pts", "gone.pts"), "points.sprj")
    end = ended("spel", "check", points)
    assert end.code == 0
    assert "Missing in the folder of the project file: gone.pts" in end.err
    assert "lists no program" in ended("spel", "check", program("ENVT0100\n", "no.sprj")).err


def test_every_fault_is_in_the_json_document(ended, program):
    end = ended("spel", "check", program("Function main\nPrint (\nGoTo away\nFend\n"), "--json")
    assert end.code == 2
    first, second = json.loads(end.out)["faults"]
    assert (first["file"], first["line"], first["column"]) == ("main.prg", 2, 8)
    assert "NUMBER" in first["expected"]
    assert (second["line"], second["column"]) == (3, None)
    assert "3108" in second["text"]


@pytest.mark.parametrize(
    ("text", "encoding", "told"),
    [("等待信号", "gbk", "gbk"), ("ハンド開閉", "cp932", "cp932"), ("等待", "utf-8", "")],
)
def test_the_code_page_is_found_out_and_told(ended, tmp_path, text, encoding, told):
    path = tmp_path / "main.prg"
    path.write_bytes(f'Function main\n  Print "{text}"\nFend\n'.encode(encoding))
    end = ended("spel", "run", str(path))
    assert end.out == f"{text}\n"
    assert (f"read as {told}" in end.err) is bool(told)
    named = ended("spel", "run", str(path), "--encoding", encoding)
    assert (named.out, named.err) == (f"{text}\n", "")
    assert "no code page" in ended("spel", "check", str(path), "--encoding", "gbk9").err


def test_a_function_says_first_what_the_project_keeps_outside(ended, program):
    main = program("Function main\n  Home\n  Print CX(TLSet(2)), AtHome\nFend\n")
    setup = program(
        "Function setup\n  HomeSet 0, 0, 0, 0\n  TLSet 2, XY(5, 0, 0, 0)\nFend\n", "setup.prg"
    )
    assert ended("spel", "run", main).code == 5
    end = ended("spel", "run", main, setup, "--before", "setup")
    assert (end.code, end.out) == (0, "5 -1\n")
    assert "no function gone" in ended("spel", "run", main, "--before", "gone").err


def test_the_robot_that_nobody_named_is_named_when_a_point_is_out_of_reach(ended, program):
    path = program("Function main\n  Go XY(900, 0, 0, 0)\nFend\n")
    assert "The program ran on T6-602S" in ended("spel", "run", path).err
    assert "The program ran on" not in ended("spel", "run", path, "--robot", "T6-602S").err


def test_a_served_controller_is_prepared_before_it_is_served(program):
    simulator = EpsonSimulator()
    text = "Function setup\n  TLSet 2, XY(5, 0, 0, 0)\nFend\nFunction bad\n  Tool 9\nFend\n"
    path = Path(program(text))
    load_programs(simulator, [path], [], ProjectSurroundings(before="setup"))
    assert simulator.machine.tools.get(2) is not None
    with pytest.raises(ConfigError, match="bad, named with --before, failed"):
        load_programs(simulator, [path], [], ProjectSurroundings(before="bad"))
