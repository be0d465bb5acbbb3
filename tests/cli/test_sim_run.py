"""sim run and demo: refused files, and all kinds served at once."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from urllib.request import urlopen

import pytest
from robolink_cli import main
from robolink_cli.commands.simulate.cells_file import KINDS, DeclaredKeys, read_cells
from robolink_cli.commands.simulate.demo import (
    DemoOperator,
    DemoSettings,
    require_refused,
)
from robolink_cli.commands.simulate.demo import _on_plc as on_plc
from robolink_cli.commands.simulate.demo_changes import AcceptedChange
from robolink_cli.commands.simulate.sim import sim
from robolink_cli.commands.simulate.sim_run import SCHEMA, _tell_end, made
from robolink_simulators.control.client import ControlClient

import robolink
from robolink import ToolOffset
from robolink.controllers import PlcMapController
from robolink.errors import ConfigError
from robolink.testing import confirm_whole_map
from tests._documents import wrong_in

# sim run: the keys of its file, refusals, and all kinds served at once.

MAP = Path(__file__).parents[2] / "examples/plc-maps/commit-bit.toml"
HEAD = 'schema = "robolink/sim-cells/1"\n'
ALL_KINDS = f"""{HEAD}
[cells.press]
kind = "epson"
count = 2
tcp = "127.0.0.1:0"
robot = "C8-C901S"
option = {{ terminator = "cr" }}
speed = 20

[cells.line]
kind = "epson"
serial = "pty"
speed = 0

[cells.glue]
kind = "softmotion"
tcp = "127.0.0.1:0"
serial = "pty"
world = {{ eye_sigma_mm = 0.25 }}

[cells.filler]
kind = "plc"
map = "{MAP}"
tcp = "127.0.0.1:0"
"""


@pytest.fixture
def file(tmp_path):
    """A maker of files."""

    def written(text):
        path = tmp_path / "cells.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return written


@pytest.mark.parametrize("kind", KINDS)
def test_every_option_of_a_command_is_a_key_of_its_table(kind):
    command = sim.commands[kind]
    alone = {
        "control",
        "with-parent",
        "idle-exit",
        "json",
        "lang",
        "log-file",
        "log-level",
        "help",
        "replay",
    }
    alone |= {"modbus-tcp", "modbus-rtu"}  # the old names of --tcp and --serial
    options = {max(it.opts, key=len).lstrip("-") for it in command.params} - alone
    keys = DeclaredKeys(command, Path()).options
    assert set(keys) == {name.replace("-", "_") for name in options}


def test_a_table_means_what_the_command_line_means(file, tmp_path):
    typed = [
        *("--serial=pty", "--baud=9600", "--robot=T6-602S,C8-C901S"),
        *("--option=terminator=cr", "--option=companion=true", "--world=eye_sigma_mm=0.5"),
        *("--com=2=/dev/pts/9", "--allow-remote", "--speed=0.5", "--exchange=0.25", "--seed=4"),
        *(f"--state={tmp_path / 'a.json'}", f"--program={MAP}", f"--program={MAP}"),
    ]
    table = {
        "serial": "pty",
        "baud": 9600,
        "robot": "T6-602S,C8-C901S",
        "option": {"terminator": "cr", "companion": True},
        "world": {"eye_sigma_mm": 0.5},
        "com": {"2": "/dev/pts/9"},
        "allow_remote": True,
        "speed": 0.5,
        "exchange": 0.25,
        "seed": 4,
        "state": "a.json",
        "program": [str(MAP), str(MAP)],
    }
    command = sim.commands["epson"]
    objections = []
    given = DeclaredKeys(command, tmp_path).values(table, lambda *said: objections.append(said))
    assert objections == []
    assert given == command.make_context("sim", typed).params
    there = {"tcp": "127.0.0.1:5001"}
    placed = DeclaredKeys(command, tmp_path).values(there, lambda *said: objections.append(said))
    assert objections == []
    assert placed == command.make_context("sim", ["--tcp=127.0.0.1:5001"]).params


def test_a_fleet_counts_ports_seeds_nodes_and_names_up(file, tmp_path):
    text = f"""{HEAD}
[cells.a]
kind = "epson"
count = 12
tcp = "127.0.0.1:6000"
seed = 5
state = "{{name}}.json"
[cells.b]
kind = "softmotion"
count = 3
tcp = "[::1]:7000"
can = "virtual:x"
[cells.c]
kind = "epson"
tcp = "127.0.0.1:6012"
"""
    cells = {cell.name: cell for cell in read_cells(file(text), sim.commands)}
    assert list(cells) == [*(f"a-{n:02}" for n in range(1, 13)), "b-1", "b-2", "b-3", "c"]
    last = cells["a-12"].given
    assert (last["address"], last["seed"], last["state"]) == (
        "127.0.0.1:6011",
        16,
        tmp_path / "a-12.json",
    )
    assert [cells[f"b-{n}"].given["address"] for n in (1, 2, 3)] == [
        "[::1]:7000",
        "[::1]:7001",
        "[::1]:7002",
    ]
    assert [cells[f"b-{n}"].given["node"] for n in (1, 2, 3)] == [5, 6, 7]
    assert (cells["c"].assist, cells["a-01"].assist) == (True, False)
    assert not (tmp_path / "a-01.json").exists()


@pytest.mark.parametrize(
    ("tables", "told"),
    [
        ('[cells.a]\nkind = "epsom"', 'line 3, cells.a.kind: must be one of "epson"'),
        ('[cells.a]\nkind = "epson"\ncolour = 1', "line 4, cells.a.colour: is not known"),
        ('[cells.a]\nkind = "epson"\nreplay = "x"', "line 4, cells.a.replay: is not known"),
        ('[cells.a]\nkind = "epson"\nseed = "1"', "line 4, cells.a.seed: must be a whole number"),
        ('[cells.a]\nkind = "epson"\nseed = -1', "line 4, cells.a.seed: -1 is not in the range"),
        ('[cells.a]\nkind = "epson"\nspeed = 1001', "line 4, cells.a.speed: 1001"),
        (
            '[cells.a]\nkind = "epson"\ntcp = "here"',
            "line 4, cells.a.tcp: 'here' is not an address",
        ),
        ('[cells.a]\nkind = "epson"\nserial = "com"', "line 4, cells.a.serial: 'com' is not 'pty'"),
        (
            '[cells.a]\nkind = "epson"\ntcp = "127.0.0.1:0"\nserial = "pty"',
            "line 2, cells.a: --serial and --tcp cannot be combined",
        ),
        ('[cells.a]\nkind = "epson"\nallow_remote = 1', "line 4, cells.a.allow_remote: must be"),
        ('[cells.a]\nkind = "epson"\noption = ["a=1"]', "line 4, cells.a.option: must be a table"),
        ('[cells.a]\nkind = "epson"\nprogram = "m.prg"', "line 4, cells.a.program: must be a list"),
        ('[cells.a]\nkind = "epson"\ncount = 0', "line 4, cells.a.count: must be at least 1"),
        ('[cells.a]\nkind = "epson"\nrobot = "R2D2"', "line 2, cells.a: There is no simulated"),
        (
            '[cells.a]\nkind = "epson"\noption.hue = 1',
            "line 2, cells.a: The EPSON simulator has no",
        ),
        ('[cells.a]\nkind = "epson"\npoints = []\n[cells.a.world]\nx = 1', "line 2, cells.a: "),
        ('[cells.a]\nkind = "epson"\n[cells.a.options]\nx = 1', "line 4, cells.a.options: is not"),
        ('[cells.a]\nkind = "plc"', "line 2, cells.a.map: is missing"),
        (
            f'[cells.a]\nkind = "plc"\nmap = "{MAP}"\nassist = true',
            "line 5, cells.a.assist: must be f",
        ),
        ('[cells."a b"]\nkind = "epson"', "line 2, cells.a b: a name has"),
        (
            '[cells.a]\nkind = "epson"\n[cells.b]\nkind = "epson"\ntcp = "127.0.0.1:5000"',
            "line 6, cells.b.tcp: a uses it already",
        ),
        (
            '[cells.a]\nkind = "epson"\ncount = 2\ntcp = "127.0.0.1:0"\nstate = "s.json"',
            "line 6, cells.a.state: a-1 uses it already",
        ),
        (
            '[cells.a]\nkind = "epson"\nstate = "s.json"\n'
            '[cells.b]\nkind = "epson"\ntcp = "127.0.0.1:0"\nstate = "b/../s.json"',
            "line 8, cells.b.state: a uses it already",
        ),
        (
            '[cells.a]\nkind = "epson"\ncount = 3\ntcp = "127.0.0.1:65534"',
            "line 5, cells.a.tcp: there are not that many ports",
        ),
        (
            '[cells.a]\nkind = "softmotion"\ncount = 124\ncan = "virtual:x"',
            "line 4, cells.a.count: a bus has at most 127 nodes",
        ),
        ("", "cells: must be a table"),
        ('[cell.a]\nkind = "epson"', "line 2, cell: is not known; did you mean cells?"),
    ],
)
def test_what_is_wrong_is_told_with_line_and_key(file, tables, told):
    with pytest.raises(ConfigError) as refused:
        read_cells(file(HEAD + tables), sim.commands)
    assert told in str(refused.value)


def test_cells_on_serial_lines_share_no_port(file):
    line = 'kind = "epson"\nserial = "pty"\n'
    cells = read_cells(file(f"{HEAD}[cells.a]\n{line}[cells.b]\n{line}count = 2\n"), sim.commands)
    assert [(cell.name, cell.given["address"]) for cell in cells] == [
        *(("a", None), ("b-1", None), ("b-2", None))
    ]


def test_all_that_is_wrong_is_told_at_once_and_nothing_is_served(file, capsys):
    path = file('[cells.a]\nkind = "epson"\nseed = "1"\nspeed = -1\n')
    assert main.run(["sim", "run", str(path)]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert "has 3 errors" in told.err
    assert all(word in told.err for word in ("schema", "line 3, cells.a.seed", "cells.a.speed"))


def test_a_file_is_checked_without_opening_a_port(file, capsys):
    path = file(ALL_KINDS)
    assert main.run(["--json", "sim", "run", str(path), "--check"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["cells"] == ["press-1", "press-2", "line", "glue", "filler"]


def started(path, *arguments, folder):
    """Run ``sim run`` to its end in a separate process."""
    paths = os.pathsep.join(one for one in sys.path if one)
    return subprocess.run(
        [sys.executable, "-m", "robolink_cli", "sim", "run", str(path), *arguments],
        env={**os.environ, "PYTHONPATH": paths, "TMPDIR": str(folder)},
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )


def ended(pid):
    """Wait until a process is gone."""
    for _ in range(400):
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.05)
    return False


@pytest.mark.skipif(os.name == "nt", reason="needs pseudo terminals")
def test_all_kinds_are_served_by_one_process_until_it_is_told_to_end(file, tmp_path, monkeypatch):
    done = started(file(ALL_KINDS), "--wait-ready", "--idle-exit", "60", folder=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    document = json.loads(done.stdout)
    assert wrong_in(document) == []
    try:
        cells = document["cells"]
        assert list(cells) == ["press-1", "press-2", "line", "glue", "filler"]
        for number, (name, cell) in enumerate(cells.items(), 1):
            monkeypatch.setenv("ROBOLINK_STATE_DIR", cell["state_dir"])
            for url in cell["urls"].values():
                with robolink.connect(url, timeout_s=5.0) as controller:
                    if isinstance(controller, PlcMapController):
                        confirm_whole_map(controller)
                    wanted = ToolOffset(number, len(url), -30.0)
                    controller.tools.write(2, wanted, expected=robolink.ANY)
            with ControlClient(cell["control"]) as control:
                assert control.do("truth")["stored"]["2"]["x_mm"] == pytest.approx(number)
                assert control.about()["seed"] == cell["seed"]
                assert ("assist" in cell) == (name in ("line", "glue"))
        with ControlClient(cells["glue"]["control"]) as control:
            assert control.do("set_world")["parameters"]["eye_sigma_mm"] == 0.25
    finally:
        os.kill(document["pid"], signal.SIGTERM)
    assert ended(document["pid"])
    assert not Path(document["state_dir"]).exists()


@pytest.mark.parametrize(
    "after", ["", '{"error": {"what": "The port is gone.", "remedy": "Wait."}}']
)
def test_an_end_after_the_first_line_is_told_only_where_there_is_an_error(after, capsys):
    ready = json.dumps({"schema": SCHEMA, "cells": []})
    _tell_end(f"{ready}\n{after}", "")
    assert capsys.readouterr().err == ("robolink: The port is gone.\n  Wait.\n" if after else "")


@pytest.mark.soak
def test_a_port_that_is_taken_ends_it_all_by_the_name_of_the_cell(file, tmp_path):
    import socket

    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        table = '[cells.a]\nkind = "epson"\ntcp = "127.0.0.1:0"\n[cells.b]\nkind = "epson"\n'
        path = file(f'{HEAD}{table}tcp = "127.0.0.1:{port}"\n')
        for how in ((), ("--wait-ready",)):
            done = started(path, *how, folder=tmp_path)
            assert (done.returncode, done.stdout) == (3, "")
            assert "The simulated cell b cannot run:\n" in done.stderr
            assert "    The simulator cannot listen on 127.0.0.1" in done.stderr
            assert [one.name for one in tmp_path.iterdir()] == [path.name]


@pytest.mark.soak
@pytest.mark.skipif(os.name == "nt", reason="Windows does not tell that a parent has ended")
def test_in_the_background_they_end_with_the_shell_that_started_them(file, tmp_path):
    path = file(f'{HEAD}[cells.a]\nkind = "epson"\ntcp = "127.0.0.1:0"\n')
    line = f'"{sys.executable}" -m robolink_cli sim run "{path}" --wait-ready --with-parent'
    paths = os.pathsep.join(one for one in sys.path if one)
    shell = subprocess.Popen(
        ["/bin/sh", "-c", f"{line}; read line"],
        env={**os.environ, "PYTHONPATH": paths, "TMPDIR": str(tmp_path)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert shell.stdout is not None
    pid = json.loads(shell.stdout.readline())["pid"]
    time.sleep(1.2)  # two readings
    os.kill(pid, 0)
    shell.communicate("\n")
    assert ended(pid)


def test_the_file_of_the_page_is_right_as_it_stands_there(file, tmp_path):
    page = (Path(__file__).parents[2] / "docs/fleet.md").read_text(encoding="utf-8")
    _, _, rest = page.partition("\n## Many simulated controllers")[2].partition("```toml\n")
    (tmp_path / MAP.name).write_bytes(MAP.read_bytes())
    cells = read_cells(file(rest.partition("```")[0]), sim.commands)
    assert len(cells) == 202
    made(cells)
    assert (tmp_path / "state" / "glue.json").exists()


def test_a_cell_of_a_file_is_made_when_it_is_first_used(file):
    text = HEAD + '[cells.many]\nkind = "epson"\ntcp = "127.0.0.1:0"\nrobot = "C8-C901S,T6-602S"\n'
    (cell,) = read_cells(file(text), sim.commands)
    (simulator,) = made([cell]).values()
    with ExitStack() as stack:
        served = cell.kind.serve(stack, simulator, cell.given, person=cell.assist)
        document = served.document("http://127.0.0.1:1")
        assert document["robot"] == "C8-C901S"
        assert "machine" not in vars(simulator)
        with robolink.connect(str(document["url"])) as controller:
            controller.status()
        assert vars(simulator)["machine"].model.name == document["robot"]


@pytest.mark.parametrize("kind", ["epson", "softmotion"])
def test_a_cell_with_a_camera_names_where_its_pictures_are(file, tmp_path, kind):
    table = f'[cells.a]\nkind = "{kind}"\ntcp = "127.0.0.1:0"\ncamera = "127.0.0.1:0"\n'
    (tmp_path / "pictures").mkdir()
    (cell,) = read_cells(file(f'{HEAD}{table}camera_folder = "pictures"\n'), sim.commands)
    (simulator,) = made([cell]).values()
    with ExitStack() as stack:
        served = cell.kind.serve(stack, simulator, cell.given, person=False)
        camera = served.document("http://127.0.0.1:1")["camera"]
        assert isinstance(camera, dict)
        assert camera["size_px"] == [1280, 1024]
        assert sorted(camera["urls"]) == ["jpg", "pgm", "png", "stream"]
        with urlopen(camera["url"], timeout=30) as answer:
            assert answer.read(2) == b"P5"
        assert served.requests == 1
        end_s = time.monotonic() + 30
        while not list((tmp_path / "pictures").glob("*.png")):
            assert time.monotonic() < end_s
            time.sleep(0.05)


def test_a_camera_at_no_address_is_refused_by_its_option(file):
    table = '[cells.a]\nkind = "epson"\ncamera = "everywhere"\n'
    with pytest.raises(ConfigError, match="camera"):
        read_cells(file(f"{HEAD}{table}"), sim.commands)


# ``robolink demo --operator``: a careful person gets a new tool, a careless one a refusal.

STORED = {"x_mm": 12.0, "y_mm": -3.5, "z_mm": -20.0}


def test_a_careful_person_is_believed_and_a_believed_one_is_no_refusal():
    change = on_plc(DemoSettings(2, 20.0, DemoOperator.CAREFUL, 0.0))
    assert isinstance(change, AcceptedChange)
    assert change.error_mm < 0.05
    with pytest.raises(RuntimeError, match="accepted the careless touches, on Kin_Scara3_Z"):
        require_refused([change])


@pytest.mark.soak
def test_who_stands_there_is_said_in_the_document(capsys):
    assert main.run(["demo", "--json", "--speed", "100", "--operator", "careful"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["operator"] == "careful"
    assert [one["refused"] for one in document["controllers"]] == [None, None]


@pytest.mark.parametrize("answer_ms", [pytest.param(0, marks=pytest.mark.soak), 20])
def test_in_simulated_time_each_exchange_takes_the_answer_time(capsys, answer_ms):
    assert main.run(["demo", "--json", "--speed", "0", "--answer-ms", str(answer_ms)]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["schema"], document["answer_ms"]) == ("robolink/demo/2", answer_ms)
    assert [one["kind"] for one in document["controllers"]] == ["epson", "softmotion"]
    assert document["controllers"][1]["exchanges"] <= 700
    for one in document["controllers"]:
        assert {"recovered", "truth", "drift_mm"} <= set(one)
        assert one["error_mm"] < 0.05
        assert one["exchanges"] > 100
        # While the robot moves, answers to the looks at it take no time of their own.
        assert one["simulated_s"] > max(10, one["exchanges"] * answer_ms / 1000)


@pytest.mark.soak
def test_at_a_pace_of_real_time_no_simulated_seconds_are_told(capsys):
    assert main.run(["demo", "--json", "--speed", "100", "--answer-ms", "5"]) == 0
    scara, plc = json.loads(capsys.readouterr().out)["controllers"]
    assert scara["simulated_s"] is None
    assert plc["simulated_s"] > plc["exchanges"] * 0.005


@pytest.mark.soak
def test_an_eye_changes_both_nozzles(capsys):
    assert main.run(["demo", "--json", "--eye", "--speed", "0", "--seed", "2"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["eye"] is True
    for one in document["controllers"]:
        assert one["error_mm"] < 0.01 < 0.2 < one["error_before_mm"]
        assert one["pictures"] > 40
        assert not wrong_in(document)


def test_an_eye_has_no_careless_person(capsys):
    assert main.run(["demo", "--eye", "--operator", "careless"]) == 2
    assert "leave --operator out" in capsys.readouterr().err


def test_a_pace_slower_than_real_time_is_refused(capsys):
    assert main.run(["demo", "--speed", "0.5"]) == 2
    assert "0, or from 1 to 100" in capsys.readouterr().err


@pytest.mark.parametrize("seed", [1, pytest.param(3, marks=pytest.mark.soak)])
def test_a_careless_person_is_refused_and_the_old_tool_stays_in_force(capsys, seed):
    words = ("demo", "--speed", "100", "--operator", "careless", "--seed", str(seed))
    assert main.run([*words, "--json"]) == 0
    shown = capsys.readouterr()
    document = json.loads(shown.out)
    assert document["operator"] == "careless"
    assert [one["kind"] for one in document["controllers"]] == ["epson", "softmotion"]
    for one in document["controllers"]:
        assert one["refused"]["code"] == "not_touched"
        assert "recovered" not in one
        assert {name: one["in_force"][name] for name in STORED} == pytest.approx(STORED)
        assert abs(one["truth"]["x_mm"] - STORED["x_mm"]) > 0.1
    assert "only presses Enter" in shown.err
    assert shown.err.count("Refused: ") == 2
    assert shown.err.count("still holds X 12.000 Y -3.500 Z -20.000") == 2
