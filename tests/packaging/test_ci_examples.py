"""The pages' statements about pipelines, nights and limits run and hold."""

import importlib.util
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_cli.commands.measure.solve import answer
from robolink_simulators.control import assist as port
from robolink_simulators.hosting import replay

from robolink.backup import _file as backup
from robolink.config import passwords as password
from robolink.files import named, toml
from robolink.register_maps import _drafts as drafts

# The container file and the pipeline of docs/testing.md: their shell parts, run in a plain shell.
#
# No container engine is needed, and none was asked: that the image is built is not shown here.

EXAMPLES = Path(__file__).parents[2] / "examples/ci"


def instructions():
    """Return the instructions of the container file, as (name, rest)."""
    text = (EXAMPLES / "Containerfile").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    return [(name, rest) for name, _, rest in (line.partition(" ") for line in lines)]


def one(name):
    """Return the rest of the only instruction of that name."""
    (rest,) = [rest for found, rest in instructions() if found == name]
    return rest


@pytest.fixture
def environment(tmp_path):
    """The container's environment, with ports that are free here."""
    cells = tmp_path / "cells.toml"
    text = (EXAMPLES / "container.toml").read_text(encoding="utf-8")
    cells.write_text(re.sub(r'"0\.0\.0\.0:\d+"', '"127.0.0.1:0"', text), encoding="utf-8")
    folder = Path(sys.executable).parent
    return {
        **os.environ,
        "PATH": f"{folder}{os.pathsep}{os.environ['PATH']}",
        "CELLS": str(cells),
        "READY": str(tmp_path / "ready.json"),
        "CONTROL": "127.0.0.1:0",
    }


@pytest.mark.parametrize("name", ["cells.toml", "container.toml"])
def test_the_files_of_cells_are_right(name, capsys):
    assert main.run(["--json", "sim", "run", str(EXAMPLES / name), "--check"]) == 0
    assert "glue" in json.loads(capsys.readouterr().out)["cells"]


def test_the_container_listens_where_it_says():
    exposed = one("EXPOSE").split()
    text = (EXAMPLES / "container.toml").read_text(encoding="utf-8")
    assert re.findall(r'tcp = "0\.0\.0\.0:(\d+)"', text) == ["5000", "5502"]
    assert "count = 10" in text
    assert exposed == ["5000-5009", "5502", "8080"]
    assert "0.0.0.0:8080" in one("ENTRYPOINT")
    assert one("COPY").split()[1] == one("ENV").split()[0].removeprefix("CELLS=")


def test_the_pipeline_runs_the_script_that_is_shipped():
    text = (EXAMPLES / "pipeline.yml").read_text(encoding="utf-8")
    assert re.findall(r"- run: (.*)", text) == ["pip install robolink", "sh pipeline.sh"]


@pytest.mark.soak
@pytest.mark.timeout(600)
@pytest.mark.skipif(os.name == "nt", reason="needs a POSIX shell")
def test_what_the_container_runs_works_in_a_plain_shell(environment):
    (checked,) = [rest for name, rest in instructions() if name == "RUN" and "robolink sim" in rest]
    subprocess.run(["/bin/sh", "-c", checked], env=environment, check=True, timeout=100)
    healthy = one("HEALTHCHECK").partition("CMD ")[2]

    def is_healthy():
        looked = ["/bin/sh", "-c", healthy]
        done = subprocess.run(looked, env=environment, check=False, capture_output=True)
        return done.returncode == 0

    assert not is_healthy()
    served = subprocess.Popen(json.loads(one("ENTRYPOINT")), env=environment)
    try:
        for _ in range(600):
            if is_healthy():
                break
            time.sleep(0.1)
        else:
            pytest.fail("it never was healthy")
        ready = json.loads(Path(environment["READY"]).read_text(encoding="utf-8"))
        assert len(ready["cells"]) == 11
        # The shell has become robolink: a stopped container ends well, and at once.
        assert ready["pid"] == served.pid
        served.send_signal(signal.SIGTERM)
        assert served.wait(timeout=60) == 0
    finally:
        served.kill()


# ``make nightly``: every part is run, bounded, and reported with its end.

ROOT = Path(__file__).parents[2]
_SPEC = importlib.util.spec_from_file_location("nightly", ROOT / "tools/nightly.py")
assert _SPEC is not None
nightly = importlib.util.module_from_spec(_SPEC)
sys.modules["nightly"] = nightly  # a dataclass looks for its module there
assert _SPEC.loader is not None
_SPEC.loader.exec_module(nightly)

HELD = "seed 7 epson: 20 h, 9 events, ab every rule held\n"


def outcome(script, tmp_path, *, share=1.0, night_h=1.0, endless=False):
    part = nightly.Part("a part", share, ("sh", "-c", script), endless)
    return nightly.carry_out(part, night_h, tmp_path, tmp_path)


@pytest.mark.parametrize(
    ("script", "how", "lacks"),
    [
        ("echo fine", "passed", ()),
        ("exit 3", "FAILED", ()),
        ("echo Not all judges are here. Install them.; exit 2", "not run", 1),
        ("echo 'newest-3.14          NOT RUN  no Python 3.14'; exit 1", "not run", 1),
        ("echo 'a  NOT RUN  no x'; echo 'b  FAILED'; exit 1", "FAILED", 1),
        ("echo 'SKIPPED [2] tests/peers/judge_x.py:9: no iec2c'", "passed", ("no iec2c",)),
    ],
)
def test_a_part_is_told_as_it_ended(tmp_path, script, how, lacks):
    found = outcome(script, tmp_path)
    assert found.how == how
    assert len(found.lacks) == lacks if isinstance(lacks, int) else found.lacks == lacks
    assert (tmp_path / "a-part.log").exists()


@pytest.mark.parametrize(
    ("endless", "printed", "how"),
    [
        (False, HELD, "FAILED"),
        (True, HELD, "passed"),
        (True, HELD.replace("every rule held", "moves once: twice") + HELD, "FAILED"),
        (True, "nothing yet\n", "FAILED"),
    ],
)
def test_what_is_stopped_at_its_share_counts_by_what_it_has_shown(endless, printed, how):
    part = nightly.Part("a part", 1, (), endless)
    assert nightly.judged(part, None, printed, 1.0).how == how


def test_a_part_is_ended_at_its_share_with_all_that_it_started(tmp_path):
    found = outcome("sleep 600 & echo $! > child; wait", tmp_path, night_h=2 / 3600)
    assert (found.how, "share" in found.said) == ("FAILED", True)
    child = Path("/proc") / (tmp_path / "child").read_text().strip() / "stat"
    for _ in range(100):
        if not child.exists() or child.read_text().split()[2] == "Z":
            return
        time.sleep(0.1)
    pytest.fail("it goes on")


def test_a_command_that_is_missing_is_not_run(tmp_path):
    part = nightly.Part("a part", 1, ("no-such-program-of-anybody",))
    assert nightly.carry_out(part, 1, tmp_path, tmp_path).how == "not run"


def test_the_table_counts_what_was_not_run_apart():
    outcomes = [
        nightly.Outcome("docs", "passed", 1.25),
        nightly.Outcome("peers", "not run", 0, lacks=("no mbpoll",)),
        nightly.Outcome("faults", "FAILED", 2, "ended with 2"),
    ]
    text = "\n".join(nightly.table(outcomes, "commit abc, 2026-11-28"))
    assert "commit abc, 2026-11-28" in text
    assert "| docs | passed | 1.2 |" in text
    assert "1 passed, 1 FAILED, 1 not run." in text
    assert "* not run: peers: no mbpoll" in text


def test_a_night_can_be_made_in_pieces(tmp_path):
    kept = tmp_path / "outcomes.json"
    faults, docs = (nightly.Outcome(name, "FAILED", 2, lacks=("x",)) for name in ("faults", "docs"))
    assert nightly.with_those_of_before([faults], "commit a", kept) == [faults]
    assert nightly.with_those_of_before([docs], "commit a", kept) == [docs, faults]
    mended = nightly.Outcome("docs", "passed", 1)
    assert nightly.with_those_of_before([mended], "commit a", kept) == [mended, faults]
    assert nightly.with_those_of_before([mended], "commit b", kept) == [mended]


def test_the_shares_are_one_night_and_each_target_exists():
    assert sum(part.share for part in nightly.PARTS) == pytest.approx(1)
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    words = {word for part in nightly.PARTS if part.command[0] == "make" for word in part.command}
    assert words - targets == {"make", "-o", "SEEDS=fresh", "MARKS=soak and not fault"}
    with pytest.raises(SystemExit, match="There is no part tea"):
        nightly.chosen(["tea"])
    assert [part.name for part in nightly.chosen(["fresh-seeds"])] == ["fresh seeds"]


# The limits that docs/security.md names are those that hold.

PAGE = Path(__file__).parents[2] / "docs" / "security.md"


def shown(size):
    return f"{size // 1_000_000} MB" if size >= 1_000_000 else f"{size // 1000} kB"


def test_every_limit_of_the_page_is_the_one_in_the_code():
    text = PAGE.read_text(encoding="utf-8").partition("## Limits of what is read")[2]
    rows = dict(re.findall(r"^\| ([^|]+?) \| ([^|]+?) \|$", text.partition("\n## ")[0], re.M))
    of_toml = f"{shown(toml.MOST_BYTES)}, {toml._MOST_PARTS} parts of a key"
    assert rows == {
        "what": "most",
        "cell file, recipe, PLC map": of_toml,
        "backup, register list": shown(backup._LONGEST),
        "poses, points, state of a simulator, profile": shown(named.MOST_BYTES),
        "a password file": shown(password._MOST_BYTES),
        "cases of `solve`": shown(answer._MOST_BYTES),
        "a recording that is replayed": shown(replay._MOST_BYTES),
        "a line at a simulator's assist port": (
            f"{port.LONGEST_LINE} bytes, {port.MOST_CLIENTS} clients"
        ),
    }
    assert drafts._MOST_BYTES == backup._LONGEST
