"""schemathesis sends the panel every request in the document of line computers' jobs.

Its environment is that of ``judge_openapi.py``.
"""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from robolink_cli.panel.guard import line_gate

from tests.panel.plant._served import PlantPanel, token_of

JUDGE = shutil.which("schemathesis", path=str(Path(sys.prefix) / "schemathesis/bin"))
DOCUMENT = (Path(__file__).parents[2] / "docs" / "jobs.openapi.json").read_text()
CELL = "line3-a"

pytestmark = [
    pytest.mark.timeout(600),
    pytest.mark.skipif(
        JUDGE is None, reason="schemathesis could not be installed from the package index"
    ),
]


@pytest.fixture
def judged(tmp_path, monkeypatch):
    """Has a panel judged by a document; returns the exit code, and the text."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("ROBOLINK_PLANT", str(tmp_path / "plant.db"))
    monkeypatch.setattr(line_gate, "JOBS_A_SECOND", 1e9)
    monkeypatch.setattr(line_gate, "STRANGE_A_SECOND", 1e9)
    monkeypatch.chdir(tmp_path)

    def judge(document, *options):
        (tmp_path / "openapi.json").write_text(document)
        with PlantPanel().served((CELL,)) as panel:
            asked = ["run", "openapi.json", "--url", f"http://127.0.0.1:{panel.port}"]
            # Which cells and recipes there are, no document knows: 422 says so.
            asked += ["--exclude-checks", "positive_data_acceptance"]
            asked += ["--header", f"Authorization: Bearer {token_of()}", "--seed", "1"]
            done = subprocess.run(
                [JUDGE or "", *asked, "--no-color", "--continue-on-failure", *options],
                capture_output=True,
                text=True,
                timeout=500,
                check=False,
            )
        return done.returncode, done.stdout + done.stderr

    return judge


def test_the_panel_answers_what_the_document_says(judged):
    code, said = judged(DOCUMENT, "--max-examples", "20")
    assert code == 0, said
    assert "Tested: 2" in said


def test_the_judge_sees_a_document_that_is_wrong(judged):
    document = json.loads(DOCUMENT)
    document["paths"]["/jobs"]["post"]["responses"].pop("422")
    code, said = judged(json.dumps(document), "--phases", "coverage")
    assert (code, "Undocumented status code" in said) == (1, True), said
