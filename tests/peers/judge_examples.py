"""The programs of examples/, run as by a user with the wheel and nothing else.

Third-party checkers read them against the wheel; then each is run with good and with wrong input.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import platformdirs
import pytest

from tests._mail_server import mail_server

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
PROGRAMS = EXAMPLES / "programs"
TYPED = [str(path) for name in ("programs", "services") for path in EXAMPLES.glob(f"{name}/*.py")]
PYRIGHT = ROOT / ".venv/pyright/node_modules/pyright/index.js"
OFFSETS = {"1": {"x_mm": 12.3, "y_mm": -3.7, "z_mm": -20.0}, "2": {"x_mm": 40.0}}

pytestmark = [pytest.mark.timeout(300), pytest.mark.skipif(os.name == "nt", reason="POSIX")]


@pytest.fixture(scope="session")
def installed(tmp_path_factory):
    """An environment with the wheel in place of the sources; robolink's dependencies are shared."""
    folder = tmp_path_factory.mktemp("installed")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    subprocess.run([sys.executable, "-m", "venv", str(folder / "env")], check=True)
    python = folder / "env/bin/python"
    install = [python, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", str(wheel)]
    subprocess.run(install, check=True)
    (packages,) = (folder / "env/lib").glob("python3.*/site-packages")
    # A line in such a file is a folder to import from; the .pth files in that folder are not read,
    # and the one of the sources is among them.
    (shared,) = (Path(sys.prefix) / "lib").glob("python3.*/site-packages")
    (packages / "shared.pth").write_text(f"{shared}\n")
    where = "import robolink, robolink_cli; print(robolink.__file__)"
    found = subprocess.check_output([python, "-c", where], cwd=folder, text=True)
    assert found.startswith(str(packages))
    return python


class Ended(NamedTuple):
    code: int
    out: str
    err: str


@pytest.fixture
def run(installed, tmp_path):
    """Runs a program in the folder of the test, with the commands of the wheel on the PATH."""
    variables = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    variables |= {
        "PATH": f"{installed.parent}{os.pathsep}{os.environ['PATH']}",
        "ROBOLINK_STATE_DIR": str(tmp_path / "state"),
        "PYTHONDONTWRITEBYTECODE": "1",
    }

    def started(*words: object) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [str(word) for word in words],
            cwd=tmp_path,
            env=variables,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def ended(*words: object, meanwhile: Callable[[subprocess.Popen[str]], None] | None = None):
        process = started(*words)
        try:
            if meanwhile is not None:
                meanwhile(process)
            out, err = process.communicate(timeout=200)
        finally:
            process.kill()
        return Ended(process.returncode, out, err)

    return ended


@pytest.fixture
def cells(run, tmp_path):
    """Twelve cells on ports and a cell file with their names; returns the simulator of each."""
    (tmp_path / "sim.toml").write_text(
        'schema = "robolink/sim-cells/1"\n'
        '[cells.line]\nkind = "epson"\ntcp = "127.0.0.1:0"\nspeed = 50\ncount = 12\n'
    )
    served = json.loads(run("robolink", "sim", "run", "sim.toml", "--wait-ready").out)
    (tmp_path / "robolink.toml").write_text(
        "".join(f'[cells.{name}]\nurl = "{one["url"]}"\n' for name, one in served["cells"].items())
    )
    (tmp_path / "offsets.json").write_text(json.dumps(OFFSETS))
    try:
        yield served["cells"]
    finally:
        os.kill(served["pid"], signal.SIGTERM)


# Results of type checkers


@pytest.fixture
def typed(tmp_path):
    """The programs, and one with a fault that only a reader of robolink's own types can find."""
    wrong = tmp_path / "wrong.py"
    wrong.write_text("import robolink\n\nrobolink.connect('x').tools.read('one')\n")
    return [*TYPED, str(wrong)]


def test_mypy_finds_nothing_in_its_strict_mode(installed, typed, tmp_path):
    paths = os.pathsep.join([str(PROGRAMS), str(EXAMPLES / "services")])
    mypy = [sys.executable, "-m", "mypy", "--strict", "--python-executable", str(installed)]
    done = subprocess.run(
        [*mypy, "--config-file", os.devnull, "--cache-dir", str(tmp_path / "cache"), *typed],
        cwd=tmp_path,
        env={**os.environ, "MYPYPATH": paths},
        capture_output=True,
        text=True,
        check=False,
    )
    (fault,) = [line for line in done.stdout.splitlines() if ": error: " in line]
    assert fault.startswith("wrong.py:3:"), done.stdout


def test_pyright_finds_nothing_in_its_strict_mode(installed, typed, tmp_path):
    node = shutil.which("node")
    if node is None or not PYRIGHT.exists():
        pytest.skip("pyright is not here: make peers fetches it with npm")
    # It takes no paths but relative ones.
    include = [os.path.relpath(path, tmp_path) for path in typed]
    settings = {"include": include, "typeCheckingMode": "strict", "extraPaths": [str(PROGRAMS)]}
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings))
    done = subprocess.run(
        [node, str(PYRIGHT), "-p", str(tmp_path), "--pythonpath", str(installed), "--outputjson"],
        capture_output=True,
        text=True,
        check=False,
    )
    told = json.loads(done.stdout)
    assert told["summary"]["filesAnalyzed"] == len(typed)
    (fault,) = told["generalDiagnostics"]
    assert Path(fault["file"]).name == "wrong.py"


# The third-party packages that a driver needs


def test_tools_are_written_with_nothing_but_platformdirs(installed, cells, tmp_path, run):
    """As docs/install.md says of ``pip install --no-deps robolink platformdirs``."""
    packages = tmp_path / "packages"
    packages.mkdir()
    (wheel,) = installed.parents[2].glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(packages)
    (packages / "platformdirs").symlink_to(Path(platformdirs.__file__).parent)
    program = (
        "import sys\n"
        "sys.path.append(sys.argv[1])\n"
        "from robolink import ToolOffset, connect\n"
        "from robolink.transaction import ToolChange, Wanted, recover\n"
        "with connect(sys.argv[2]) as controller:\n"
        "    wanted = Wanted(4, ToolOffset(1, 2, -3), controller.tools.read(4))\n"
        "    with ToolChange(controller, [wanted], verify=True) as change:\n"
        "        change.write()\n"
        "        change.keep()\n"
        "    print(controller.tools.read(4), controller.status().state)\n"
        "    controller.stop()\n"
    )
    alone = [sys.executable, "-I", "-S", "-c", program]  # no site-packages
    ended = run(*alone, packages, cells["line-07"]["url"])
    assert (ended.code, "x_mm=1.0" in ended.out) == (0, True), ended


# change_and_try.py


def x_of(run, cell):
    shown = json.loads(run("robolink", "--json", "-c", cell, "tool", "get", "1").out)
    return shown["offset"]["x_mm"]


def change(run, installed, cell, *command, **more):
    program = PROGRAMS / "change_and_try.py"
    return run(installed, program, cell, "offsets.json", "--", *command, **more)


def test_production_keeps_what_a_good_part_proved(run, installed, cells):
    assert change(run, installed, "line-01", "true").code == 0
    assert x_of(run, "line-01") == 12.3
    assert change(run, installed, "line-02", "false").code == 1
    assert x_of(run, "line-02") == 12.0
    assert change(run, installed, "line-99", "true").code == 2


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_production_that_is_ended_while_the_part_is_made_puts_back(
    run, installed, cells, tmp_path, number, code
):
    def end(process: subprocess.Popen[str]) -> None:
        while not (tmp_path / "begun").exists():
            assert process.poll() is None
        process.send_signal(number)

    command = ["sh", "-c", "touch begun; exec sleep 100"]
    ended = change(run, installed, "line-03", *command, meanwhile=end)
    assert ended.code == code, ended
    assert x_of(run, "line-03") == 12.0


def test_production_whose_link_is_cut_leaves_it_to_recover(run, installed, cells):
    cut = f"robolink sim ctl --at {cells['line-04']['control']} cut_link"
    # A part that is done before the next look, every 0.2 s, is good and its values stay.
    ended = change(run, installed, "line-04", "sh", "-c", f"{cut} && sleep 2")
    assert ended.code == 6, ended
    assert run("robolink", "-c", "line-04", "recover", "--yes").code == 0
    assert x_of(run, "line-04") == 12.0


# nightly_check.py


def test_twelve_cells_are_checked_and_mailed(run, installed, cells):
    program = [installed, PROGRAMS / "nightly_check.py", "--sender", "a@plant", "--to", "b@plant"]
    with mail_server() as (server, mails):
        assert run(*program, "--smtp", server).code == 0
        run("robolink", "sim", "ctl", "--at", cells["line-05"]["control"], "press_estop")
        assert run(*program, "--smtp", server).code == 1
    subjects = [str(mail["Subject"]) for mail in mails]
    assert subjects == ["0 of 12 cells need attention", "1 of 12 cells need attention: line-05"]
    unsent = run(*program, "--smtp", server, "line-01")
    assert (unsent.code, "line-01: in order" in unsent.out) == (69, True)


# test_cell.py, lost_answer.mjs, pipeline.sh


def test_the_tests_of_a_cell_pass(run, installed):
    options = ["-q", "-p", "no:cacheprovider", "-p", "no:xdist", "-c", os.devnull]
    ended = run(installed, "-m", "pytest", *options, "--rootdir", PROGRAMS, PROGRAMS)
    assert (ended.code, " passed" in ended.out) == (0, True), ended.out


def test_node_tells_a_program_that_repeats_a_write_from_one_that_does_not(run, cells):
    cell = cells["line-06"]
    judge = ["node", PROGRAMS / "lost_answer.mjs", cell["control"], "TLSet 2, XY", "--"]
    write = ["robolink", "-c", cell["url"], "tool", "set", "2", "--x", "1", "--y", "2", "--z", "3"]
    careful = run(*judge, *write)
    assert (careful.code, "arrived: 1" in careful.out) == (0, True), careful
    port = cell["url"].rpartition(":")[2]
    twice = (  # the behaviour of a client that takes a lost answer for a lost request
        "import socket\n"
        "for _ in range(2):\n"
        f"    with socket.create_connection(('127.0.0.1', {port})) as wire:\n"
        "        wire.settimeout(3)\n"
        "        wire.sendall(b'$Login,\\r\\n')\n"
        "        wire.recv(99)\n"
        "        wire.sendall(b'$Execute,\"TLSet 2, XY(1, 2, 3, 0)\"\\r\\n')\n"
        "        try:\n"
        "            wire.recv(99)\n"
        "        except TimeoutError:\n"
        "            pass\n"
    )
    repeating = run(*judge, sys.executable, "-c", twice)
    assert (repeating.code, "arrived: 2" in repeating.out) == (1, True), repeating
    assert run(*judge, "true").code == 2
    assert run(*judge, "/no/such/program").code == 2
    assert run("node", PROGRAMS / "lost_answer.mjs").code == 2
    assert run(*judge[:2], "http://127.0.0.1:1/x", *judge[3:], "true").code == 3


def test_the_pipeline_is_through_in_a_plain_shell(run, tmp_path):
    for name in ("cells.toml", "pipeline.sh"):
        shutil.copy(EXAMPLES / "ci" / name, tmp_path / name)
    done = run("sh", "pipeline.sh")
    assert done.code == 0, done.err
    assert done.out.endswith("The pipeline is through.\n")
    assert "TLSet 3, XY" in (tmp_path / "wire.txt").read_text(encoding="utf-8")
    # It ends at the first surprise, here with a file that is no recipe.
    (tmp_path / "needle.toml").write_text("not = 'a recipe'\n")
    assert run("sh", "pipeline.sh").code == 2
