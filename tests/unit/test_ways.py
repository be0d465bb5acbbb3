"""A sentence of the library asks for things in the words of the program that shows it."""

import ast
import re
from pathlib import Path

import pytest
from robolink_cli.console.shell_words import SHELL_WAYS

import robolink
from robolink.controllers.tool_table import require_replacement
from robolink.errors import SelectedToolError
from robolink.ways import Way, speaking, way

LIBRARY = Path(robolink.__file__).parent
OPTION = re.compile(r"(?<![\w-])--[a-z]")


def sentences(path):
    """Yield the sentences of a module that a person is shown."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "tr":
            first = node.args[0]
            if isinstance(first, ast.Constant):
                yield first.value


def test_the_shell_has_a_word_for_every_way():
    ways = [text for name, text in vars(Way).items() if name.isupper()]
    assert len(set(ways)) == len(ways) > 30
    assert set(SHELL_WAYS) == set(ways)


def test_no_sentence_of_the_library_names_an_option_of_the_command_line():
    found = [
        (str(path.relative_to(LIBRARY)), text)
        for path in sorted(LIBRARY.rglob("*.py"))
        for text in sentences(path)
        if OPTION.search(text)
    ]
    assert found == []


def test_each_program_says_it_in_its_own_words():
    with pytest.raises(SelectedToolError, match=r"then_select=NUMBER, 0 for the flange"):
        require_replacement(3, None)
    with (
        speaking(SHELL_WAYS),
        pytest.raises(SelectedToolError, match=r"--then-select NUMBER, 0 for the flange"),
    ):
        require_replacement(3, None)
    assert way(Way.RECORD) == "trace"
