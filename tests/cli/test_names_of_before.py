"""The map of commands: the first page, the groups, and that every name of before still works.

``commands_of_before.json`` is the tree as it was before there were groups: each command with its
options, arguments and their types ("!" is required, "*" may be repeated, "?" is a flag).
"""

import contextlib
import io
import json
import os
from pathlib import Path

import click
import pytest
from robolink_cli import main
from robolink_cli.command_map import RENAMED, SECTIONS
from robolink_cli.commands.groups import config

BEFORE = json.loads(Path(__file__).with_name("commands_of_before.json").read_text("utf-8"))
TODAY = {
    **{old: new for old, (_, new) in RENAMED.items()},
    **{f"config {old}": new for old, (_, new) in config.renamed.items()},
}
OF_ITS_OWN = {"enable", "disable", "resolve"}
"""Older names that still answer in their own words; each is a command of its own."""


def command_at(path):
    """Return the command of a full name, as the command line looks it up."""
    found: click.Command | None = main.cli
    for word in path.split():
        assert isinstance(found, click.Group), path
        found = found.get_command(click.Context(found), word)
    assert found is not None, path
    return found


def signature(parameter):
    marks = ("!" if parameter.required else "") + ("*" if parameter.multiple else "")
    marks += "?" if getattr(parameter, "is_flag", False) else ""
    marks += f"x{parameter.nargs}" if parameter.nargs != 1 else ""
    options = "/".join(sorted([*parameter.opts, *parameter.secondary_opts]))
    return f"{options} {parameter.type.name}{marks}"


def _choices(parameters):
    kinds = (parameter.type for parameter in parameters)
    return {str(one) for kind in kinds if isinstance(kind, click.Choice) for one in kind.choices}


def run_on_terminal(*arguments):
    """Run a command line whose stderr is a terminal; return the exit code and what stood there."""
    here, there = os.openpty()
    with (
        open(here, "rb", buffering=0) as screen,
        open(there, "w", encoding="utf-8") as terminal,
        contextlib.redirect_stderr(terminal),
        contextlib.redirect_stdout(io.StringIO()),
    ):
        code = main.run(arguments)
        terminal.flush()
        os.set_blocking(screen.fileno(), False)
        shown = screen.read() or b""
    return code, shown.decode().splitlines()


@pytest.mark.parametrize("name", BEFORE["commands"])
def test_each_name_of_before_takes_what_it_took(name):
    given = [signature(parameter) for parameter in command_at(name).params]
    wanted = BEFORE["commands"][name]
    if wanted[:1] == ["shared"]:
        wanted = BEFORE["shared"] + wanted[1:]
    # What had to be given may be left out today; nothing more has to be given. That a number has
    # limits may be told by the option today, where the command told it before.
    given, wanted = ([line.replace(" range", "") for line in lines] for lines in (given, wanted))
    taken = {line.replace("!", "") for line in given}
    assert not [line for line in wanted if line.replace("!", "") not in taken]
    assert not [line for line in given if "!" in line and line not in wanted]


def test_no_name_of_before_is_forgotten():
    heads = {name.split()[0] for name in BEFORE["commands"]}
    listed = {name for part in SECTIONS.values() for name in part}
    assert heads <= listed | set(RENAMED) | {"config"}
    assert {f"config {name}" for name in config.renamed} <= set(BEFORE["commands"])


@pytest.mark.parametrize("old", sorted(set(TODAY) - OF_ITS_OWN))
def test_old_and_new_name_are_one_command(old):
    assert command_at(old) is command_at(TODAY[old])


@pytest.mark.parametrize("old", sorted(OF_ITS_OWN))
def test_one_that_answers_in_its_own_words_names_a_command_that_takes_its_word(old):
    path, *values = TODAY[old].rsplit(" ", 1) if old != "resolve" else (TODAY[old],)
    parameters = command_at(path).params
    assert [value for value in values if value not in _choices(parameters)] == []


@pytest.mark.parametrize(
    ("old", "line"),
    [
        (["recalibrate"], "recalibrate is now called change."),
        (["var", "get"], "var is now called robot variable."),
        (["config", "check"], "config check is now called cell validate."),
    ],
)
def test_on_a_terminal_one_line_says_the_name_of_today(old, line):
    code, shown = run_on_terminal(*old, "--help")
    assert code == 0
    assert shown == [line]


def test_a_name_of_today_says_nothing_and_a_program_reads_nothing(capsys):
    assert run_on_terminal("change", "--help") == (0, [])
    assert main.run(["recalibrate", "--help"]) == 0
    assert capsys.readouterr().err == ""


def test_the_first_page_has_at_most_twelve_entries_and_names_what_is_there(capsys):
    entries = {name: line for part in SECTIONS.values() for name, (_, line) in part.items()}
    assert len(entries) <= 12
    for name in ("tool", "robot", "journal", "cell"):
        group = command_at(name)
        assert set(entries[name].split()) <= set(group.list_commands(click.Context(group)))
    assert main.run(["--help"]) == 0
    page = capsys.readouterr().out.splitlines()
    assert all(len(line) <= 78 for line in page)
    shown = [line.split()[0] for line in page if line.startswith("  ") and line[2] != " "]
    assert shown == list(entries)


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        (["chnage"], "'change'"),
        (["tool", "lst"], "'list'"),
        (["robot", "rset"], "'reset'"),
        (["recieps"], "'recipe'"),
        (["xyzzy"], ""),
    ],
)
def test_a_name_that_is_mistyped_gets_one_of_today_suggested(typed, offered, capsys):
    assert main.run(typed) == 2
    said = capsys.readouterr().err
    assert offered in said
    assert ("Did you mean" in said) is bool(offered)
    assert "recalibrate" not in said


@pytest.mark.parametrize(
    ("typed", "named"),
    [
        ("drift", ["journal drift"]),
        ("list", ["tool list", "journal list", "cell list"]),
        ("motors", []),
        ("needle", []),
    ],
)
def test_a_command_of_a_group_is_named_where_its_group_was_left_out(typed, named, capsys):
    assert (main.run([typed]) == 2) or typed == "motors", "that one has an older, shorter name"
    said = capsys.readouterr().err
    assert said.count("There is 'robolink ") == len(named)
    for one in named:
        assert f"There is 'robolink {one}'." in said


def test_the_first_page_names_the_pages_and_the_recipes(capsys):
    assert main.run(["--help"]) == 0
    page = capsys.readouterr().out
    for words in (["docs"], ["recipe", "list"]):
        assert f"robolink {' '.join(words)}" in page
        assert main.run(words) == 0


def test_old_names_are_offered_nowhere():
    assert not set(main.cli.list_commands(click.Context(main.cli))) & set(RENAMED)
    assert config.list_commands(click.Context(config)) == []


def test_the_first_page_does_not_load_the_commands():
    with main.cli.while_listing():
        stand_in = main.cli.get_command(click.Context(main.cli), "calibrate")
    assert type(stand_in) is click.Command
