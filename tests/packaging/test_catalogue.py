"""The catalogue of sentences is complete."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
CATALOGUE = ROOT / "robolink" / "locale" / "robolink.pot"


def recipe():
    """Return the options with which ``make messages`` collects."""
    makefile = (ROOT / "Makefile").read_text().replace("\\\n", " ")
    (line,) = re.findall(r"babel\.messages\.frontend (--quiet extract .*)", makefile)
    return line.split()


def test_the_catalogue_holds_what_the_sources_say(tmp_path):
    fresh = tmp_path / "robolink.pot"
    options = [
        f"--output-file={fresh}" if option.startswith("--output-file") else option
        for option in recipe()
    ]
    subprocess.run(
        [sys.executable, "-m", "babel.messages.frontend", *options],
        cwd=ROOT,
        check=True,
        capture_output=True,
        timeout=50,
    )
    assert fresh.read_text() == CATALOGUE.read_text(), "run: make messages"
