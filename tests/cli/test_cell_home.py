"""A cell whose home is another computer: from here it is looked at and stopped, never changed."""

import json

import pytest
from robolink_cli import main
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.config import connect_cell, find_cell, load_cell_files
from robolink.errors import ConfigError, NotAtHomeError
from robolink.inspection import check_cells, recover_cell
from robolink.journal import CellHome, name_journals, open_journal
from robolink.model import ToolOffset
from robolink.serving import CallbackConversation, CallbackLimits
from robolink.transaction import carrying_out
from tests.cli.test_refusals_of_every_command import NEEDS_A_CONTROLLER
from tests.faults._requests import changes

HERE = "PC8"

LOOKS = {
    *("status", "robot where", "stop", "robot reset", "tool list", "tool get"),
    *("expert verify-controller", "expert check-contract"),
}
"""Commands that only look, stop or calm."""

CALMS = {"stop", "robot reset", "expert verify-controller"}
"""Those that send more than questions: the last one a pause, and no statement that stays."""

READS_FILE_FIRST = {"tool restore", "tool compare"}


@pytest.fixture(autouse=True)
def computer(monkeypatch):
    """Call this computer PC8, or as a test says."""

    def called(name):
        monkeypatch.setattr("platform.node", lambda: name)

    called(HERE)
    yield called
    name_journals({}, afresh=True)


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder with the cell file and, at its beginning, no journal."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROBOLINK_CONFIG", str(tmp_path / "robolink.toml"))
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.delenv("ROBOLINK_JOURNAL", raising=False)
    return tmp_path


@pytest.fixture
def simulator():
    return EpsonSimulator(seed=5)


@pytest.fixture
def url(simulator):
    with serve_tcp(simulator) as host:
        yield host.url


def written(place, text):
    (place / "robolink.toml").write_text(text)


def line3(place, url, home, more=""):
    said = f'remote_timeout_s = 60.0\nremote_timeout_confirmed_by = "Li"\n{more}'
    written(place, f'[cells.line3]\nurl = "{url}"\nhome = "{home}"\n{said}')


def refusal(capsys):
    error = json.loads(capsys.readouterr().out)["error"]
    assert error["kind"] == "NotAtHomeError", error
    return error


def heard(simulator):
    return [text for _, direction, text in simulator.log if direction == ">"]


def test_every_command_that_does_not_only_look_is_refused_before_it_connects(
    place, simulator, url, capsys
):
    line3(place, url, "PC7")
    (place / "golden.json").write_text("{}")
    for name, arguments in NEEDS_A_CONTROLLER.items():
        capsys.readouterr()
        before = len(heard(simulator))
        code = main.run(["--json", "-c", "line3", *name.split(), *arguments])
        sent = heard(simulator)[before:]
        if name in LOOKS:
            assert (code == 2, bool(sent)) == (False, True), name
            assert name in CALMS or changes(sent) == []
            continue
        assert code == 2, name
        if name not in READS_FILE_FIRST:
            error = refusal(capsys)
            assert "The home of line3 is PC7" in error["what"]
            assert "PC7" in error["remedy"]
        assert sent == [] or name == "cell tools"  # which needs the record for what it has read
    assert not (place / "state" / "journal.db").exists()


def test_a_backup_is_neither_compared_nor_restored_elsewhere(place, simulator, url, capsys):
    line3(place, url, HERE)
    assert main.run(["-c", "line3", "tool", "backup", "golden.json"]) == 0
    line3(place, url, "PC7")
    before = heard(simulator)
    for words in (["restore", "golden.json", "--yes"], ["compare", "golden.json"]):
        capsys.readouterr()
        assert main.run(["--json", "-c", "line3", "tool", *words]) == 2
        refusal(capsys)
    assert heard(simulator) == before


@pytest.mark.parametrize("home", ["PC8", pytest.param("pc8", marks=pytest.mark.soak), "Pc8."])
def test_at_home_it_is_changed_however_the_name_is_written(place, simulator, url, home):
    line3(place, url, home)
    assert main.run(["-c", "line3", "tool", "set", "1", "--x", "12.5", "--yes"]) == 0
    assert main.run(["-c", "line3", "check"]) == 0


@pytest.mark.parametrize(
    ("home", "here"), [("PC8", "pc8.plant.local"), ("pc8.plant.local", "PC8"), ("pc8.a", "pc8.b")]
)
def test_with_another_domain_it_may_be_another_computer(place, url, computer, home, here, capsys):
    computer(here)
    line3(place, url, home)
    assert main.run(["--json", "-c", "line3", "tool", "set", "1", "--x", "12.5", "--yes"]) == 2
    assert f'home = "{here}"' in refusal(capsys)["remedy"]
    line3(place, url, here)
    assert main.run(["-c", "line3", "tool", "set", "1", "--x", "12.5", "--yes"]) == 0


def test_a_computer_without_a_name_is_no_home(place, url, computer, capsys):
    computer("")
    line3(place, url, "PC7")
    assert main.run(["--json", "-c", "line3", "tool", "set", "1", "--x", "12.5", "--yes"]) == 2
    assert "without a name" in refusal(capsys)["what"]


def test_a_look_says_where_the_record_is(place, url, capsys):
    line3(place, url, "PC7")
    assert main.run(["-c", "line3", "status"]) == 0
    assert "The home of line3 is PC7" in capsys.readouterr().err
    line3(place, url, HERE)
    assert main.run(["-c", "line3", "status"]) == 0
    assert "home" not in capsys.readouterr().err
    line3(place, url, "PC7")  # the copy of the address knows of no home that has changed since
    assert main.run(["-c", "line3", "status"]) == 0
    assert "The home of line3 is PC7" in capsys.readouterr().err


def test_neither_the_environment_nor_a_glance_moves_a_home(place, url, monkeypatch, capsys):
    monkeypatch.setenv("ROBOLINK_JOURNAL", str(place / "own.db"))
    line3(place, url, "PC7", 'journal = "line3.db"\n')
    assert main.run(["-c", "line3", "status"]) == 0
    capsys.readouterr()
    assert main.run(["--json", "-c", "line3", "tool", "set", "1", "--x", "12.5", "--yes"]) == 2
    refusal(capsys)
    assert not (place / "own.db").exists()


def test_what_a_file_says_of_all_counts_for_a_cell_that_says_nothing(place, url):
    other = "epson+sim://home-of-all"
    written(
        place,
        f'home = "PC7"\n[cells.line3]\nurl = "{url}"\n'
        f'[cells.here]\nurl = "{other}"\nhome = "pc8"\n',
    )
    cells = load_cell_files().cells
    assert cells["line3"].home == CellHome("line3", "PC7")
    assert cells["here"].home.refusal() is None
    assert cells["line3"].origins["home"] == place / "robolink.toml"
    assert main.run(["-c", "line3", "undo", "--yes"]) == 2
    assert main.run(["-c", "here", "tool", "set", "1", "--x", "12.5", "--yes"]) == 0


@pytest.mark.parametrize("home", ["", "a b", "epson://x", "pc7:5000", "a,b", "x" * 254])
def test_what_no_computer_is_called_is_refused(place, url, home):
    line3(place, url, home)
    with pytest.raises(ConfigError, match="home"):
        find_cell("line3")


@pytest.mark.parametrize("kind", ["epson+sim://away", "softmotion+sim://away", "tcp"])
def test_a_program_reads_and_stops_and_changes_nothing(place, url, kind):
    line3(place, url if kind == "tcp" else kind, "PC7")
    with connect_cell("line3") as controller:
        tools = controller.tools
        before = {number: tools.read(number) for number in (1, 2)}
        selected = tools.selected()
        assert isinstance(controller.outcomes.trouble, NotAtHomeError)
        for change in (
            lambda: tools.write(1, ToolOffset(x_mm=1.5), expected=before[1]),
            lambda: tools.clear(1, expected=before[1], then_select=0),
            lambda: tools.select(0),
            lambda: controller.outcomes.take_over("it hangs"),
            lambda: carrying_out(controller, "away/1", {}).__enter__(),
        ):
            with pytest.raises(NotAtHomeError, match="The home of line3 is PC7"):
                change()
        assert {number: tools.read(number) for number in (1, 2)} == before
        assert tools.selected() == selected
        controller.stop()
    with pytest.raises(NotAtHomeError):
        recover_cell("line3")


def test_a_check_elsewhere_is_none_and_is_recorded_nowhere(place, simulator, url, capsys):
    here = "epson+sim://checked-here"
    written(
        place,
        f'[cells.line3]\nurl = "{url}"\nhome = "PC7"\n[cells.here]\nurl = "{here}"\nhome = "PC8"\n',
    )
    away, near = check_cells(["line3", "here"])
    assert away.failure is not None
    assert (away.failure.kind, near.failure) == ("NotAtHomeError", None)
    assert heard(simulator) == []
    assert main.run(["--json", "check", "line3", "here"]) == 2
    capsys.readouterr()
    assert main.run(["--json", "check", "line3", "--sensor", "camera"]) == 2
    assert heard(simulator) == []
    journal = place / "state" / "journal.db"
    assert not journal.exists() or not list(open_journal(str(journal)).checks())


def test_no_program_of_the_cell_is_served_elsewhere(place, url, capsys):
    line3(place, url, "PC7")
    line = ["--json", "-c", "line3", "expert", "serve", "--spel", "127.0.0.1:0"]
    assert main.run(line) == 2
    refusal(capsys)
    with pytest.raises(NotAtHomeError):
        CallbackConversation(
            open_journal(str(place / "x.db")),
            CallbackLimits(tolerance_mm=0.1),
            peer="127.0.0.1",
            cell=find_cell("line3"),
        )
