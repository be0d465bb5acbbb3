"""cell new: what is given or typed stands in the cell file, and nothing else is changed."""

import json

import pytest
from robolink_cli import main
from robolink_cli.commands.computer import config

from robolink.config import find_cell

URL = "epson+tcp://192.0.2.1:5000"


@pytest.fixture
def typing(monkeypatch):
    """A person at the terminal, who types these answers; returns what was asked."""

    def types(*answers):
        left, asked = list(answers), []

        def answer(question):
            asked.append(question)
            return left.pop(0)

        monkeypatch.setattr(config, "on_terminal", lambda: True)
        monkeypatch.setattr(config, "asked_for_text", answer)
        return asked

    return types


@pytest.mark.usefixtures("state_folder")
def test_what_is_typed_is_a_cell(typing, capsys):
    asked = typing("line3", URL, "T6-602S", "60", 'K. Sato "K", 2026-05-04')
    assert main.run(["cell", "new"]) == 0
    cell = find_cell("line3")
    assert (cell.url, cell.settings.robot) == (URL, "T6-602S")
    assert cell.settings.remote_timeout_s == 60
    assert cell.settings.remote_timeout_confirmed_by == 'K. Sato "K", 2026-05-04'
    assert len(asked) == 5
    assert 'Next: robolink -c "line3" status' in capsys.readouterr().out


def test_what_is_typed_wrongly_is_told_at_once_and_asked_again(
    state_folder, tmp_path, typing, capsys
):
    (tmp_path / "robolink.toml").write_text('[cells.a]\nurl = "epson+sim://a"\n')
    asked = typing("a", "b c", "b", "nonsense", URL, "-", "soon", "60", "me")
    assert main.run(["cell", "new"]) == 0
    assert find_cell("b").url == URL
    said = capsys.readouterr().err
    for told in ("has a cell a already", "cannot be the name", "'nonsense' is not", "'soon'"):
        assert told in said
    assert len(asked) == 9


def test_what_is_given_wrongly_is_refused_before_the_first_question(typing, capsys):
    asked = typing("-")
    assert main.run(["cell", "new", "b", "--url", "nonsense"]) == 2
    assert asked == []


@pytest.mark.usefixtures("state_folder")
def test_what_is_not_known_is_left_out_and_a_plc_is_asked_for_no_time_out(typing):
    asked = typing("mixer", "softmotion+modbus-tcp://192.0.2.2", "-")
    assert main.run(["cell", "new"]) == 0
    assert len(asked) == 3
    assert find_cell("mixer").settings.robot is None


def test_what_stands_in_the_file_stays_to_the_byte(state_folder, tmp_path, capsys):
    file = tmp_path / "robolink.toml"
    before = b'# mine\n[cells.a]\nurl = "epson+sim://a"   # so'
    file.write_bytes(before)
    assert main.run(["--json", "cell", "new", "b", "--url", URL]) == 0
    assert json.loads(capsys.readouterr().out)["schema"] == "robolink/cell-new/1"
    assert file.read_bytes().startswith(before)
    assert (find_cell("a").url, find_cell("b").url) == ("epson+sim://a", URL)


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ([], 9, "there is nobody to ask"),
        (["a", "--url", URL], 2, "has a cell a already"),
        (["b c", "--url", URL], 2, "cannot be the name of a cell"),
        (["b", "--url", "nonsense"], 2, "url"),
        (["b", "--url", URL, "--time-out-set", "60"], 2, "remote_timeout_confirmed_by"),
    ],
)
def test_what_is_wrong_is_refused_and_nothing_is_written(
    state_folder, tmp_path, capsys, words, code, said
):
    file = tmp_path / "robolink.toml"
    file.write_text('[cells.a]\nurl = "epson+sim://a"\n', encoding="utf-8")
    before = file.read_bytes()
    assert main.run(["cell", "new", *words]) == code
    assert said in capsys.readouterr().err
    assert file.read_bytes() == before
