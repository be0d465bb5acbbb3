"""The exit codes that are documented are those of the code, and 6 comes first."""

import re
from inspect import getsource, unwrap
from pathlib import Path

import click
import pytest
from robolink_cli import main
from robolink_cli.console import exit_codes

from robolink import errors
from robolink.standing import Standing, ToolStanding, note_standing

_PAGE = Path(__file__).parents[2] / "docs" / "commands.md"
_NAMED = {
    value
    for name, value in vars(exit_codes).items()
    if name.isupper() and isinstance(value, int) and not isinstance(value, bool)
}


def test_the_page_has_the_table_of_the_code():
    table = _PAGE.read_text().split("\n\n**6 overrides")[0]
    rows = re.findall(r"^\| (\d+) \| (.+) \|$", table, re.MULTILINE)
    assert {int(code): meaning for code, meaning in rows} == exit_codes.MEANINGS
    assert [int(code) for code, _ in rows] == sorted(exit_codes.MEANINGS)


def test_every_code_that_a_command_can_end_with_has_a_meaning():
    assert _NAMED | {code for _, code in exit_codes.EXIT_CODES} == set(exit_codes.MEANINGS)


def commands(command, path=()):
    """Yield every command below one, with its name."""
    if not isinstance(command, click.Group):
        yield " ".join(path), command
        return
    context = click.Context(command)
    for name in [*command.list_commands(context), *(["expert"] if command is main.cli else [])]:
        inner = command.get_command(context, name)
        assert inner is not None
        yield from commands(inner, (*path, name))


def test_every_command_that_can_end_with_1_stands_in_its_row():
    ending = {
        name.removeprefix("expert ")
        for name, command in commands(main.cli)
        if "return DIFFERENT" in (source := getsource(unwrap(command.callback)))
        or "else DIFFERENT" in source
    }
    assert "tool compare" in ending
    assert {name for name in ending if f"`{name}`" not in exit_codes.MEANINGS[1]} == set()


OLD, NEW = (12.0, -3.5, -20.0, 0.0, 0.0, 0.0), (12.5, -3.5, -20.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    "error",
    [
        errors.TransportBrokenError("gone"),
        errors.RemoteProtocolError("bent"),
        errors.JournalError("full"),
        errors.VerifyError("drifts"),
        errors.StoppedError("stopped"),
        OSError("no space left"),
        KeyboardInterrupt(),
    ],
    ids=lambda error: type(error).__name__,
)
def test_what_is_not_settled_outranks_whatever_broke_afterwards(error):
    settled = exit_codes.exit_code(error)
    assert settled != 6
    tools = {1: ToolStanding(before=OLD, holds=NEW, requested=NEW)}
    note_standing(error, Standing(tools=tools, settled=False, left_open=True))
    assert exit_codes.exit_code(error) == 6
    body = exit_codes.error_body(error)
    assert body["controller_state"] == "changed"
    note_standing(error, Standing(tools=tools))
    assert exit_codes.exit_code(error) == settled
