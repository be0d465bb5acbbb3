"""cell new and cell validate: the cell file written, and the values that methods will refuse."""

import json

import pytest
from robolink_cli import main
from robolink_cli.commands.computer import config

from robolink.config import find_cell, load_cells
from tests.contract._method_cell import method_cell

# cell new: given or typed values are written to the cell file, and nothing else is changed.

URL = "epson+tcp://192.0.2.1:5000"


@pytest.fixture
def typing(monkeypatch):
    """A person at the terminal who types these answers; returns the questions."""

    def types(*answers):
        left, asked = list(answers), []

        def answer(question):
            asked.append(question)
            return left.pop(0)

        monkeypatch.setattr(config, "person_here", lambda: True)
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


# ``cell validate`` reports the cell's limits that methods will refuse, in their words.

ABOVE = "The robot would stop {clearance} mm from contact, but a new tip may be {limit} mm longer."


@pytest.fixture
def cell(tmp_path, monkeypatch):
    with method_cell("epson", tmp_path, monkeypatch) as cell:
        yield cell


def say(folder, *lines):
    path = folder / "robolink.toml"
    path.write_text(path.read_text().replace("[cells.a]", "\n".join(["[cells.a]", *lines]), 1))
    return path


def check(capsys, *file):
    code = main.run(["config", "check", *map(str, file), "--json"])
    (entry,) = json.loads(capsys.readouterr().out)["files"]
    return code, {problem["where"]: problem["what"] for problem in entry["problems"]}


@pytest.mark.simulator_only
@pytest.mark.parametrize(
    ("lines", "where", "why"),
    [
        (("clearance_mm = 1",), "clearance_mm", ABOVE.format(clearance=1, limit=2)),
        (("max_change_mm = 3",), "max_change_mm", ABOVE.format(clearance=2, limit=3)),
        (
            ("clearance_mm = 2.5", "max_change_mm = 4"),
            "clearance_mm",
            ABOVE.format(clearance=2.5, limit=4),
        ),
        (("lift_mm = 5", "clearance_mm = 4"), "clearance_mm", "must be more than 1.8 below "),
    ],
)
def test_what_every_calibration_would_refuse_is_said(cell, tmp_path, capsys, lines, where, why):
    path = say(tmp_path, *lines)
    code, problems = check(capsys)
    assert (code, list(problems)) == (2, [f"cells.a.{where}"])
    assert problems[f"cells.a.{where}"].startswith(why)
    assert "two-pose" in problems[f"cells.a.{where}"]
    assert check(capsys, path) == (code, problems)
    refused = cell.calibrate("two-pose")
    assert refused.code == 2
    assert why in refused.document["error"]["what"]
    # Everything else works with such a file, above all status and stop.
    assert cell.run("status", "--json").code == 0


@pytest.mark.simulator_only
@pytest.mark.parametrize(
    "lines",
    [(), ("max_change_mm = 1.5",), ("clearance_mm = 3", "max_change_mm = 3"), ("lift_mm = 20",)],
)
def test_what_methods_take_is_right(cell, tmp_path, capsys, lines):
    say(tmp_path, *lines)
    assert check(capsys) == (0, {})
    assert load_cells()["a"]


@pytest.mark.simulator_only
def test_what_only_one_method_refuses_names_that_one(cell, tmp_path, capsys):
    say(tmp_path, "lift_mm = 6")
    code, problems = check(capsys)
    assert (code, list(problems)) == (2, ["cells.a.clearance_mm"])
    assert "These methods are not possible: one-touch." in problems["cells.a.clearance_mm"]


@pytest.mark.simulator_only
def test_files_are_looked_at_together_and_the_one_that_says_it_is_named(
    tmp_path, monkeypatch, capsys
):
    for name in ("ROBOLINK_CONFIG", "ROBOLINK_CELL"):
        monkeypatch.delenv(name, raising=False)
    near, far = tmp_path / "near", tmp_path / "far"
    near.mkdir()
    (far / "robolink").mkdir(parents=True)
    url = 'url = "epson+tcp://127.0.0.1:5000"'
    (far / "robolink" / "robolink.toml").write_text(f"[cells.a]\n{url}\nclearance_mm = 3\n")
    (near / "robolink.toml").write_text("[cells.a]\nmax_change_mm = 2.5\n")
    monkeypatch.chdir(near)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(far))
    assert main.run(["config", "check", "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["files"]) == 2
    (near / "robolink.toml").write_text("[cells.a]\nmax_change_mm = 3.5\n")
    assert main.run(["config", "check", "--json"]) == 2
    wrong = [bool(entry["problems"]) for entry in json.loads(capsys.readouterr().out)["files"]]
    # The clearance of the far file is too small.
    assert wrong == [False, True]
