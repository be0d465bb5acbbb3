"""Small programs for the interpreter, and the place of the recorded results of two compilers."""

from pathlib import Path

import pytest
from robolink_simulators.structured_text import SourceText, StructuredProgram

JUDGES = Path(__file__).parents[4] / "shared" / "judges"

needs_judges = pytest.mark.skipif(
    not JUDGES.is_dir(),
    reason="the recorded verdicts of MATIEC and STruC++ are not on this computer",
)


def program(body, declared="r : INT;", before=""):
    """Return a program with a few variables and one body."""
    text = f"{before}PROGRAM Main\nVAR\n{declared}\nEND_VAR\n{body}\nEND_PROGRAM\n"
    return StructuredProgram([SourceText("main.st", text)], "Main")


def result(body, declared="r : INT;", before=""):
    """Execute a body once and return ``r``."""
    made = program(body, declared, before)
    made.cycle(0)
    return made.value("r")
