"""The container file and the pipeline of docs/testing.md: their shell parts, run in a plain shell.

No container engine is needed, and none was asked: that the image is built is not shown here.
"""

import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from robolink_cli import main

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
    """As in the container, but for ports that are free here."""
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


@pytest.mark.soak
@pytest.mark.timeout(600)
@pytest.mark.skipif(os.name == "nt", reason="needs a POSIX shell")
def test_the_pipeline_is_through_in_a_plain_shell(environment, tmp_path):
    for name in ("cells.toml", "pipeline.sh"):
        shutil.copy(EXAMPLES / name, tmp_path / name)
    done = subprocess.run(
        shlex.split("sh pipeline.sh"),
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=500,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.endswith("The pipeline is through.\n")
    assert "TLSet 3, XY" in (tmp_path / "wire.txt").read_text(encoding="utf-8")
