"""The map of commands: groups, TAB completion, and old names that still work."""

import contextlib
import io
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.shell_completion import BashComplete
from robolink_cli import main
from robolink_cli.command_map import RENAMED, SECTIONS, SHORT_NAMES
from robolink_cli.commands.groups import config

from robolink.journal import open_log
from robolink.model import EntryKind, NewEntry, Signature
from tests.cli._fresh_python import shown_and_loaded

# completion: the scripts, and the words that TAB offers.

OTHER = "epson+tcp://192.0.2.2:5000"
URL = "epson+tcp://192.0.2.1:5000"


@pytest.fixture
def shell_environment(tmp_path):
    """An environment in which ``robolink`` is a command and ``a`` and ``line3`` are cells."""
    paths = os.pathsep.join(path for path in sys.path if path)
    program = tmp_path / "bin" / "robolink"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m robolink_cli "$@"\n')
    program.chmod(0o755)
    cells = tmp_path / "cells.toml"
    pin = '[cells.line3.stations.PIN-07]\nkind = "pin"\n'
    cells.write_text(f'[cells.line3]\nurl = "{URL}"\n{pin}[cells.a]\nurl = "{URL}"\n')
    return {
        "PATH": f"{program.parent}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": paths,
        "ROBOLINK_CONFIG": str(cells),
        "HOME": str(tmp_path),
    }


@pytest.mark.parametrize(
    ("shell", "sign"),
    [
        ("bash", "complete -o nosort -F _robolink_completion robolink"),
        ("zsh", "#compdef robolink"),
        ("fish", "complete --no-files --command robolink"),
        ("powershell", "Register-ArgumentCompleter"),
    ],
)
def test_each_shell_has_its_script(shell, sign, capsys):
    assert main.run(["completion", shell]) == 0
    shown = capsys.readouterr().out
    assert sign in shown
    assert "_ROBOLINK_COMPLETE" in shown


def test_another_shell_is_a_usage_error(capsys):
    assert main.run(["completion", "cmd"]) == 2
    assert "powershell" in capsys.readouterr().err


def test_a_click_without_that_shell_says_what_to_install(monkeypatch, capsys):
    monkeypatch.setattr("click.shell_completion.get_completion_class", lambda shell: None)
    assert main.run(["completion", "powershell"]) == 2
    assert "click 8.5" in capsys.readouterr().err


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash on this machine")
def test_tab_in_bash_offers_what_fits_and_a_name_with_blanks_and_signs_is_one_word(
    shell_environment,
):
    names = ("PIN 07", "it's", "P*", "$HOME", "\u9488")
    with open(shell_environment["ROBOLINK_CONFIG"], "a", encoding="utf-8") as file:
        for name in names:
            file.write(f'[cells.line3.stations."{name}"]\nkind = "pin"\n')
    script = """
        eval "$(robolink expert completion bash)"; cd /
        press() {
            COMPREPLY=(); COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _robolink_completion robolink
        }
        press robolink expert comp; echo "${COMPREPLY[@]}"
        press robolink status -c li; echo "${COMPREPLY[@]}"
        press robolink -c line3 cell station show ''
        for one in "${COMPREPLY[@]}"; do eval "set -- $one"; printf "%s|%s\\n" "$#" "$1"; done
    """
    done = subprocess.run(
        ["bash", "-c", script],
        env={**shell_environment, "LC_ALL": "C.UTF-8", "PYTHONUTF8": "1"},
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=30,
        check=True,
    )
    assert done.stderr == ""
    assert done.stdout.splitlines()[:2] == ["completion", "line3"]
    assert {f"1|{name}" for name in names} <= set(done.stdout.splitlines()), done.stdout


@pytest.fixture
def offered_by_tab(tmp_path, monkeypatch):
    """Return the words that TAB offers in a folder with two cells, a recipe and a journal."""
    (tmp_path / "cells.toml").write_text(
        f'[cells.line3]\nurl = "{URL}"\n[cells.line3.stations.PIN-07]\nkind = "pin"\n'
        f'[cells.a]\nurl = "{OTHER}"\n'
    )
    (tmp_path / "needle.toml").write_text('schema = "robolink/recipe/1"\n')
    (tmp_path / "needle.txt").write_text('schema = "robolink/recipe/1"\n')
    (tmp_path / "needles.toml").mkdir()
    (tmp_path / "recipes").mkdir()
    (tmp_path / "recipes" / "pin.toml").write_text('schema = "robolink/recipe/1"\n')
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROBOLINK_CONFIG", str(tmp_path / "cells.toml"))
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    for url, tool, station in ((URL, 3, "PIN-99"), (URL, 12, ""), (OTHER, 7, "BEAMS-1")):
        log = open_log(url, durable=True, signature=Signature(station=station))
        log.append(NewEntry(EntryKind.DONE, tool=tool))
        log.close()

    def press(*words):
        shell = BashComplete(main.cli, {}, "robolink", "_ROBOLINK_COMPLETE")
        return [item.value for item in shell.get_completions(list(words[:-1]), words[-1])]

    return press


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["cell", "sh"], ["show"]),
        (["-c", "line3", "tool", "get", ""], ["3", "12"]),
        (["tool", "get", "-c", "line3", "1"], ["12"]),
        (["-c", OTHER, "calibrate", "n-angle", "--tool", ""], ["7"]),
        (
            ["-c", "epson+tcp://192.0.2.9:5000", "tool", "get", "1"],
            [str(n) for n in (1, *range(10, 16))],
        ),
        (["journal", "list", "--tool", ""], ["3", "7", "12"]),
        (["-c", "line3", "calibrate", "one-touch", "--station", ""], ["PIN-07", "PIN-99"]),
        (["-c", "a", "cell", "station", "show", "B"], ["BEAMS-1"]),
        (["-c", "line3", "cell", "station", "show", "B"], []),
        (["change", ""], ["needle.toml"]),
        (["change", "recipes/p"], ["recipes/pin.toml"]),
        (["change", "nowhere/"], ["nowhere/"]),
    ],
)
def test_tab_knows_tools_stations_and_recipes(offered_by_tab, words, expected):
    assert offered_by_tab(*words) == expected


@pytest.mark.parametrize("damage", [b"", b"no database", None])
def test_tab_goes_on_without_a_journal(offered_by_tab, tmp_path, damage):
    for path in (tmp_path / "state").glob("journal.db*"):
        path.unlink()
    if damage is not None:
        (tmp_path / "state" / "journal.db").write_bytes(damage)
    assert offered_by_tab("-c", "line3", "cell", "station", "show", "") == ["PIN-07"]
    assert len(offered_by_tab("-c", "line3", "tool", "get", "")) == 15


def test_tab_reads_the_files_and_loads_nothing_heavy(shell_environment):
    heavy = {"pydantic", "rich", "serial", "keyring", "lark", "robolink.controllers"}
    heavy |= {"numpy", "pymodbus", "can", "canopen"}
    lines: list[tuple[list[str], dict[str, str]]] = [
        ([], {"COMP_WORDS": "robolink -c line3 cell station show ", "COMP_CWORD": "6"}),
        ([], {"COMP_WORDS": "robolink -c ", "COMP_CWORD": "2"}),
    ]
    everywhere = shell_environment | {"_ROBOLINK_COMPLETE": "bash_complete"}
    assert shown_and_loaded(lines, heavy, **everywhere) == [
        ["plain,PIN-07", "ended: 0 []"],
        ["plain,line3", "plain,a", "ended: 0 []"],
    ]


# The map of commands: the first page, the groups, and the old names, which still work.
# ``commands_of_before.json`` is the tree before groups were introduced: each command with its
# options, arguments and their types ("!" is required, "*" may be repeated, "?" is a flag).

BEFORE = json.loads(Path(__file__).with_name("commands_of_before.json").read_text("utf-8"))
TODAY = {
    **{old: new for old, (_, new) in RENAMED.items()},
    **{f"config {old}": new for old, (_, new) in config.renamed.items()},
}
OF_ITS_OWN = {"enable", "disable", "resolve"}
"""Older names that keep their own output; each is a command of its own."""


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
    """Run a command line whose stderr is a terminal; return the exit code and that output."""
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
    # A once required parameter may be optional today; no new one is required. The option itself may
    # enforce the limits of a number today, where the command used to.
    given, wanted = ([line.replace(" range", "") for line in lines] for lines in (given, wanted))
    taken = {line.replace("!", "") for line in given}
    assert not [line for line in wanted if line.replace("!", "") not in taken]
    assert not [line for line in given if "!" in line and line not in wanted]


def test_no_name_of_before_is_forgotten():
    heads = {name.split()[0] for name in BEFORE["commands"]}
    listed = {name for part in SECTIONS.values() for name in part}
    assert heads <= listed | set(RENAMED) | set(SHORT_NAMES)
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
        (["chnage"], "robolink change?"),
        (["tool", "lst"], "robolink tool list?"),
        (["robot", "rset"], "robolink robot reset?"),
        (["recieps"], "robolink recipe?"),
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
    meant = ", ".join(f"robolink {one}" for one in named)
    assert (f"Did you mean {meant}?" in said) is bool(named)


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
