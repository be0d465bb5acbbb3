"""completion: the scripts, and what TAB offers."""

import os
import shutil
import subprocess
import sys

import pytest
from click.shell_completion import BashComplete
from robolink_cli import main

from robolink.journal import open_log
from robolink.model import EntryKind, NewEntry, Signature

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
@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (["robolink", "expert", "comp"], {"completion"}),
        (["robolink", "-c", ""], {"line3", "a"}),
        (["robolink", "status", "-c", "li"], {"line3"}),
        (["robolink", "cell", "sh"], {"show"}),
    ],
)
def test_tab_in_bash_offers_what_fits(shell_environment, words, offered):
    quoted = " ".join(f"'{word}'" for word in words)
    script = (
        'eval "$(robolink expert completion bash)"\n'
        f"COMP_WORDS=({quoted}); COMP_CWORD={len(words) - 1}\n"
        "_robolink_completion robolink\n"
        'printf "%s\\n" "${COMPREPLY[@]}"\n'
    )
    done = subprocess.run(
        ["bash", "-c", script],
        env=shell_environment,
        capture_output=True,
        text=True,
        timeout=30,
        check=True,
    )
    assert done.stderr == ""
    assert offered <= set(done.stdout.split())
    if words[-1]:
        assert all(word.startswith(words[-1]) for word in done.stdout.split())


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash on this machine")
def test_a_name_with_blanks_and_signs_is_one_word_in_bash(shell_environment):
    names = ("PIN 07", "it's", "P*", "$HOME", "\u9488")
    cells = shell_environment["ROBOLINK_CONFIG"]
    with open(cells, "a", encoding="utf-8") as file:
        for name in names:
            file.write(f'[cells.line3.stations."{name}"]\nkind = "pin"\n')
    script = (
        'eval "$(robolink expert completion bash)"; cd /\n'
        "COMP_WORDS=(robolink -c line3 cell station show ''); COMP_CWORD=6\n"
        "_robolink_completion robolink\n"
        'for one in "${COMPREPLY[@]}"; do eval "set -- $one"; printf "%s|%s\\n" "$#" "$1"; done\n'
    )
    done = subprocess.run(
        ["bash", "-c", script],
        env={**shell_environment, "LC_ALL": "C.UTF-8", "PYTHONUTF8": "1"},
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=30,
        check=True,
    )
    assert {f"1|{name}" for name in names} <= set(done.stdout.splitlines()), done.stdout


@pytest.fixture
def offered(tmp_path, monkeypatch):
    """What TAB offers in a folder with two cells, a recipe and a journal."""
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
def test_tab_knows_tools_stations_and_recipes(offered, words, expected):
    assert offered(*words) == expected


@pytest.mark.parametrize("damage", [b"", b"no database", None])
def test_tab_goes_on_without_a_journal(offered, tmp_path, damage):
    for path in (tmp_path / "state").glob("journal.db*"):
        path.unlink()
    if damage is not None:
        (tmp_path / "state" / "journal.db").write_bytes(damage)
    assert offered("-c", "line3", "cell", "station", "show", "") == ["PIN-07"]
    assert len(offered("-c", "line3", "tool", "get", "")) == 15


def test_tab_on_a_station_loads_nothing_heavy(shell_environment):
    line = "robolink -c line3 cell station show "
    assert _loaded_by_tab(shell_environment, line, 6) == ["plain,PIN-07", "loaded: []"]


def test_tab_on_a_cell_reads_the_files_and_nothing_heavy(shell_environment):
    assert _loaded_by_tab(shell_environment, "robolink -c ", 2) == [
        *("plain,line3", "plain,a", "loaded: []")
    ]


def _loaded_by_tab(shell_environment, line, word):
    program = (
        "import atexit, sys\n"
        "heavy = {'pydantic', 'rich', 'serial', 'keyring', 'lark', 'robolink.controllers', "
        "'numpy', 'pymodbus', 'can', 'canopen'}\n"
        "atexit.register(lambda: print('loaded:', sorted(heavy & set(sys.modules))))\n"
        "from robolink_cli.main import main\n"
        "main()\n"
    )
    tab = {"_ROBOLINK_COMPLETE": "bash_complete", "COMP_WORDS": line, "COMP_CWORD": str(word)}
    done = subprocess.run(
        [sys.executable, "-S", "-c", program],
        env=shell_environment | tab,
        capture_output=True,
        text=True,
        timeout=30,
        check=True,
    )
    return done.stdout.splitlines()
