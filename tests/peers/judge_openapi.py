"""schemathesis sends each kind of simulator every request in the control API's document.

Schemathesis has its own environment (``.venv/schemathesis``, ``make peers``): it needs other
versions of the packages that the tests use.
"""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from contextlib import ExitStack
from importlib.resources import files
from pathlib import Path

import pytest
from robolink_simulators.cell.clock import SteeredClock
from robolink_simulators.control.cell import AnySimulator, ControlledCell
from robolink_simulators.control.server import ControlServer
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.plc import PlcSimulator
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

from robolink.register_maps import load_map

MAP = Path(__file__).parents[2] / "examples/plc-maps/commit-bit.toml"
JUDGE = shutil.which("schemathesis", path=str(Path(sys.prefix) / "schemathesis/bin"))
DOCUMENT = files("robolink_simulators.control").joinpath("openapi.json").read_text()
MAKES: dict[str, Callable[[], AnySimulator]] = {
    "epson": lambda: EpsonSimulator(seed=3),
    "softmotion": lambda: SoftMotionSimulator(seed=3),
    "plc": lambda: PlcSimulator(load_map(MAP)),
}

pytestmark = [
    pytest.mark.timeout(1000),
    pytest.mark.skipif(
        JUDGE is None, reason="schemathesis could not be installed from the package index"
    ),
]


@pytest.fixture
def judged(tmp_path):
    """Has a simulator of some kind judged by a document; returns the exit code, and the text."""
    with ExitStack() as stack:

        def judge(kind, document, *options):
            (tmp_path / "openapi.json").write_text(document)
            (tmp_path / "schemathesis.toml").write_text('[parameters]\n"path.cell" = "cell"\n')
            cell = ControlledCell(MAKES[kind](), SteeredClock(20))
            server = stack.enter_context(ControlServer({"cell": cell}))
            asked = ["run", "openapi.json", "--url", server.url, "--seed", "1", "--no-color"]
            done = subprocess.run(
                [JUDGE or "", *asked, "--continue-on-failure", "--max-examples", "5", *options],
                cwd=tmp_path,
                capture_output=True,
                text=True,
                timeout=900,
                check=False,
            )
            return done.returncode, done.stdout + done.stderr

        yield judge


@pytest.mark.parametrize("kind", MAKES)
def test_each_kind_answers_what_the_document_says(judged, kind):
    code, said = judged(kind, DOCUMENT)
    assert code == 0, said
    assert "Tested: 64" in said
    assert "Coverage" in said


def _number(path):
    """Return the schema of the number of an input."""
    return path["post"]["requestBody"]["content"]["application/json"]["schema"]["properties"][
        "number"
    ]


@pytest.mark.parametrize(
    ("damage", "code"),
    [
        (lambda path: _number(path).update(maximum=10**6), "ST202"),
        (lambda path: path.update(put=path.pop("post")), "ST202"),
        (lambda path: path["post"]["responses"].pop("200"), "ST"),
    ],
)
def test_the_judge_sees_a_document_that_is_wrong(judged, damage, code):
    path = "/cells/{cell}/set_input"
    document = json.loads(DOCUMENT)
    document["paths"] = {path: document["paths"][path]}
    damage(document["paths"][path])
    ended, said = judged("epson", json.dumps(document), "--phases", "coverage")
    assert (ended, f"\n- {code}" in said) == (1, True), said
