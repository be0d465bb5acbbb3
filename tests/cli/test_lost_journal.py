"""An emptied, deleted, replaced or damaged journal does not pass for "nothing is open"."""

import sqlite3

import pytest
from robolink_cli import main
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process import epson, softmotion
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
import robolink.transaction
from robolink.controllers import EpsonController
from robolink.errors import JournalError, OutcomeUnknownError
from robolink.journal import open_journal
from robolink.journal._connections import _closed, _opened, close_files
from robolink.model import ANY, EntryKind, NewEntry, ToolOffset


def forget_connections():
    """Forget all connections, as a new process does."""
    close_files()
    _opened.clear()
    _closed.clear()


def delete(path):
    for file in path.parent.glob("journal.db*"):
        file.unlink()


def empty(path):
    with sqlite3.connect(path) as connection:
        for table in ("entries", "markers", "leases", "addresses", "former_names"):
            connection.execute(f"DELETE FROM {table}")
        connection.execute("UPDATE head SET number = 0, hash = ''")
    connection.close()


@pytest.fixture
def changed(run, simulator, state_folder):
    """A controller that was changed once; returns the path of the journal."""
    assert run("tool", "set", "1", "--x", "13", "--yes")[0] == 0
    simulator.machine.tools.select(0)  # as a killed calibration leaves it
    forget_connections()
    return state_folder / "journal.db"


@pytest.mark.parametrize("lose", [delete, empty])
def test_a_journal_without_history_of_a_known_controller_blocks_until_a_person_looked(
    run, changed, simulator, lose
):
    lose(changed)
    code, _, err = run("status")
    assert code == 0
    assert "has no record of it" in err
    stood = simulator.machine.tip()
    assert run("jog", "x+1", "--yes")[0] == 6
    assert run("tool", "set", "1", "--x", "14", "--yes")[0] == 6
    assert simulator.machine.tip() == stood
    code, out, err = run("recover")
    assert code == 6
    assert "No job is left unfinished" not in out + err
    assert "Tool 0 is selected" in out + err
    assert "robolink tool compare" in out + err
    # Asking about it does not count as finishing it.
    assert run("recover")[0] == 6
    assert run("resolve", "--yes")[0] == 0
    code, out, err = run("recover")
    assert "No job is left unfinished" in out + err
    assert "has no record of it" not in run("status")[2]


@pytest.mark.parametrize("gone", ["backups", "controllers"])
def test_either_sign_is_enough(run, changed, gone, state_folder):
    delete(changed)
    (file,) = (state_folder / gone).iterdir()
    file.unlink()
    assert "has no record of it" in run("status")[2]


def test_another_place_is_named(run, changed, tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_JOURNAL", str(tmp_path / "elsewhere.db"))
    err = run("status")[2]
    assert f"Its record was kept in sqlite:///{changed}" in err


def test_a_controller_that_was_never_changed_is_just_new(run, changed):
    assert "has no record of it" not in run("status")[2]


def test_a_write_that_changed_nothing_loses_no_record(run, simulator):
    same = str(simulator.machine.tools.get(1).x_mm)
    assert run("tool", "set", "1", "--x", same, "--yes")[0] == 0
    assert "has no record of it" not in run("status")[2]


def bend(path, old, new):
    """Change bytes of the file, as a faulty disk does; SQLite does not notice."""
    content = path.read_bytes()
    assert old in content
    path.write_bytes(content.replace(old, new))


BENT = {
    "a value of the newest entry": lambda path: bend(path, b"13.0", b"18.0"),
    "the end": lambda path: _sql(path, "DELETE FROM entries WHERE number > 3"),
    "the head": lambda path: _sql(path, "UPDATE head SET hash = 'x'"),
}


def _sql(path, *statements):
    with sqlite3.connect(path) as connection:
        for statement in statements:
            connection.execute(statement)
    connection.close()


@pytest.mark.parametrize("how", BENT)
@pytest.mark.fault("F62")
def test_what_was_bent_is_noticed_before_a_write_and_keeps_nobody_from_looking(
    run, changed, simulator, how
):
    simulator.machine.tools.select(1)
    BENT[how](changed)
    assert run("status")[0] == 0
    before = simulator.machine.tools.get(1)
    code, _, err = run("tool", "set", "1", "--x", "15", "--yes")
    assert code == 2
    assert "it is damaged (" in err
    assert simulator.machine.tools.get(1) == before
    assert run("journal", "verify")[0] == 1


@pytest.mark.fault("F62")
def test_a_bent_page_of_the_markers_is_noticed(run, changed, simulator):
    simulator.machine.tools.select(1)
    connection = sqlite3.connect(changed)
    (page,) = connection.execute(
        "SELECT rootpage FROM sqlite_schema WHERE name='markers'"
    ).fetchone()
    (size,) = connection.execute("PRAGMA page_size").fetchone()
    connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    connection.close()
    content = bytearray(changed.read_bytes())
    # The number of cells of the page.
    content[(page - 1) * size + 3 : (page - 1) * size + 5] = b"\x00\x07"
    changed.write_bytes(content)
    code, _, err = run("tool", "set", "1", "--x", "15", "--yes")
    assert code == 2
    assert "it is damaged" in err
    with pytest.raises(JournalError):
        open_journal().log("anybody").look()


@pytest.fixture
def doubted(simulator, state_folder):
    """A controller with an unanswered write by a program, and no first backup."""
    dropped: list[str] = []

    def lose_the_answer(_number, request):
        if "TLSet 1," in request and not dropped:
            dropped.append(request)
            simulator.on_request = None
            simulator.panel.cut_link()

    simulator.on_request = lose_the_answer
    with robolink.connect(simulator.url) as controller, pytest.raises(OutcomeUnknownError):
        controller.tools.write(1, ToolOffset(12.5, -3.25, -20), expected=ANY)
    forget_connections()
    return state_folder / "journal.db"


def test_a_program_does_not_write_again_while_an_outcome_is_unknown(doubted, simulator):
    """All ways of changing something pass the one check that refuses them."""
    simulator.machine.tools.set(2, ToolOffset(4, 5, -60))  # at the pendant
    with robolink.connect(simulator.url) as controller:
        assert isinstance(controller, EpsonController)
        for change in (
            lambda: controller.tools.write(1, ToolOffset(1, 2, 3), expected=ANY),
            lambda: controller.tools.write(2, ToolOffset(1, 2, 3), expected=ANY),
            lambda: controller.tools.clear(2, expected=ANY, then_select=0),
            lambda: controller.tools.select(0 if controller.tools.selected() else 2),
            lambda: controller.io.set_output(3, True),
            lambda: controller.execute_raw("Off 3"),
        ):
            before = controller.tools.read_all(), controller.tools.selected()
            with pytest.raises(OutcomeUnknownError, match="did not finish"):
                change()
            assert (controller.tools.read_all(), controller.tools.selected()) == before
        assert len(controller.outcomes.open_markers()) == 1
        found = robolink.transaction.recover(controller, confirm=lambda _finding: True)
        assert not found.left
        kinds = {entry.kind for entry in controller.outcomes.recorded()}
        assert EntryKind.CONFLICT not in kinds
        controller.tools.write(1, ToolOffset(1, 2, 3), expected=ANY)


@pytest.mark.parametrize("lose", [delete, empty])
def test_the_first_backup_does_not_make_a_lost_record_look_whole(run, doubted, simulator, lose):
    lose(doubted)
    stored = simulator.machine.tools.get(1)
    assert run("tool", "set", "1", "--x", "14", "--yes")[0] == 6
    assert simulator.machine.tools.get(1) == stored
    assert run("status")[0] == 0
    assert run("tool", "set", "1", "--x", "14", "--yes")[0] == 6
    assert run("recover")[0] == 6
    assert run("stop")[0] == 0


def test_a_program_is_refused_too_where_the_record_is_kept_elsewhere_now(
    doubted, simulator, tmp_path, monkeypatch
):
    monkeypatch.setenv("ROBOLINK_JOURNAL", str(tmp_path / "elsewhere.db"))
    for _ in range(2):  # and nothing that the first attempt recorded lets the second one through
        with robolink.connect(simulator.url) as controller:
            with pytest.raises(OutcomeUnknownError):
                controller.outcomes.append(NewEntry(EntryKind.DECISION, verdict="all is well"))
            with pytest.raises(OutcomeUnknownError):
                controller.tools.write(1, ToolOffset(1, 2, 3), expected=ANY)
        forget_connections()


BLOCKED = (
    ("tool", "set", "1", "--x", "14", "--yes"),
    ("tool", "clear", "2", "--yes"),
    ("tool", "select", "2"),
    ("tool", "restore", "backup.json", "--yes"),
    ("undo", "--yes"),
    ("robot", "jog", "z+1", "--yes"),
    ("robot", "io", "set", "3", "on"),
    ("calibrate", "two-pose", "--tool", "1", "--yes"),
)
OPEN = (
    ("status",),
    ("stop",),
    ("robot", "where"),
    ("robot", "release"),
    ("robot", "reset", "--yes"),
    ("robot", "motors", "on", "--yes"),
    ("tool", "list"),
    ("tool", "backup", "again.json"),
    ("journal", "list"),
)
PLANTS = {"epson": (EpsonSimulator, epson), "softmotion": (SoftMotionSimulator, softmotion)}


@pytest.mark.parametrize("kind", PLANTS)
def test_each_command_that_writes_or_moves_is_blocked_and_no_other(
    kind, state_folder, tmp_path, capsys
):
    """A program's first write was enough; no command was ever run before."""
    made, plant = PLANTS[kind]
    simulator = made(seed=4, state_path=tmp_path / "retained.json")
    plant.register("lost", simulator)

    def run(*arguments):
        forget_connections()
        code = main.run(["-c", f"{kind}+sim://lost", *arguments])
        return code, capsys.readouterr().err

    def tools():
        with robolink.connect(f"{kind}+sim://lost") as controller:
            return controller.tools.read_all(), controller.tools.selected()

    try:
        assert run("tool", "backup", "backup.json")[0] == 0
        with robolink.connect(f"{kind}+sim://lost") as controller:
            controller.motors(True)
            controller.tools.write(2, ToolOffset(1, 2, -30), expected=ANY)
        forget_connections()
        delete(state_folder / "journal.db")
        before = tools()
        for command in BLOCKED:
            code, said = run(*command)
            assert code == 6, (command, said)
            assert "record" in said or "journal" in said, command
        for look in OPEN[kind == "epson" :: 2]:
            assert run(*look)[0] == 0, look
        assert run("recover")[0] == 6
        assert tools() == before
        assert run("recover", "--yes")[0] == 0
        assert run("tool", "set", "1", "--x", "14", "--yes")[0] == 0
        assert "has no record of it" not in run("status")[1]
    finally:
        plant.unregister("lost")
