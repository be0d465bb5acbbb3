"""completion: the scripts, and what TAB offers."""

import os
import shutil
import subprocess
import sys

import pytest
from robolink_cli import main

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
    cells.write_text(f'[cells.line3]\nurl = "{URL}"\n[cells.a]\nurl = "{URL}"\n')
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


def test_tab_on_a_cell_reads_the_files_and_nothing_heavy(shell_environment):
    program = (
        "import atexit, sys\n"
        "heavy = {'pydantic', 'rich', 'serial', 'keyring', 'lark', 'robolink.controllers'}\n"
        "atexit.register(lambda: print('loaded:', sorted(heavy & set(sys.modules))))\n"
        "from robolink_cli.main import main\n"
        "main()\n"
    )
    tab = {"_ROBOLINK_COMPLETE": "bash_complete", "COMP_WORDS": "robolink -c ", "COMP_CWORD": "2"}
    done = subprocess.run(
        [sys.executable, "-S", "-c", program],
        env=shell_environment | tab,
        capture_output=True,
        text=True,
        timeout=30,
        check=True,
    )
    assert done.stdout.splitlines() == ["plain,line3", "plain,a", "loaded: []"]
