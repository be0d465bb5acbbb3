"""spel check, spel run, and a program in a served controller, as a person types them."""

import io
import json
import os
import tty
from pathlib import Path
from types import SimpleNamespace

import pytest
from robolink_cli.commands.simulate.kinds.epson import ProjectSurroundings
from robolink_simulators.epson import EpsonSimulator

GOOD = (
    'Function main\n  Print "one", 2\n  Wait 0.5\n  other\nFend\nFunction other\n  Print 3\nFend\n'
)


@pytest.fixture
def ended(run):
    """Return how a command ended: code, out and err."""

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
    assert "--vision goes with --program" in end.err


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
    assert f"{option} goes with --program" in end.err


def test_a_served_program_has_the_line_and_the_folder_that_were_named(tmp_path, program):
    simulator = EpsonSimulator()
    runner = simulator.load([Path(program(GOOD))])
    ProjectSurroundings(lines=["2=/dev/pts/9"], folder=tmp_path).install(simulator)
    assert runner.ports.devices == {2: "/dev/pts/9"}
    assert runner.session.files.root == tmp_path
