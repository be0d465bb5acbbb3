"""Many cells checked at once: over real sockets, with cells that are off, busy, slow or stopped."""

import os
import socket
import sqlite3
import threading
from contextlib import ExitStack, closing
from dataclasses import replace

import pytest
from robolink_cli import main
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.streams.epson import serve_serial, serve_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink.backup import read_tools
from robolink.config import add_cell, find_cell
from robolink.errors import BusyError, ConfigError
from robolink.inspection import CellCheck, CheckFailure, CheckState, check_cell, check_cells
from robolink.inspection._cell_checks import CheckSlots, most_aside
from robolink.journal import ChainConflictError, Journal, LeaseHolder, move_journal, open_journal
from robolink.journal._lease_view import this_process
from robolink.journal.store.connection import DatabaseConnection
from robolink.model import (
    EntryKind,
    Marker,
    MarkerKind,
    NewEntry,
    Signature,
    ToolOffset,
    plain_offset,
)
from robolink.stopping import StopListener, holders_of
from robolink.timing import wall_label
from robolink.transport import far_end_of, parse_url
from tests.contract.journal._acts import run
from tests.faults._requests import changes

WELL, BUSY, FAILED = CheckState.WELL, CheckState.BUSY, CheckState.FAILED


@pytest.fixture
def line(tmp_path, monkeypatch):
    """Four EPSON cells over TCP, in a cell file; gives the simulators by name."""
    file = tmp_path / "robolink.toml"
    monkeypatch.setenv("ROBOLINK_CONFIG", str(file))
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    simulators = {f"press-{number}": EpsonSimulator(seed=number) for number in range(1, 5)}
    with ExitStack() as stack:
        for name, simulator in simulators.items():
            host = stack.enter_context(serve_tcp(simulator))
            add_cell(file, name, {"url": host.url, "timeout_s": 1.0})
        yield simulators


def cells(line):
    return [find_cell(name) for name in line]


def states(checks):
    return {check.cell: check.state for check in checks}


def why(check):
    assert check.failure is not None
    return check.failure


def on_record():
    return {one.cell: one for one in open_journal().checks(newest_first=False)}


@pytest.fixture
def silent():
    """The URL of an address that takes no connection and refuses none: its queue is full."""
    with ExitStack() as stack:
        listening = stack.enter_context(socket.socket())
        listening.bind(("127.0.0.1", 0))
        listening.listen(0)
        for _ in range(2):
            waiting = stack.enter_context(socket.socket())
            waiting.setblocking(False)
            waiting.connect_ex(listening.getsockname())
        yield f"epson+tcp://127.0.0.1:{listening.getsockname()[1]}"


def test_cells_are_told_in_their_order_and_recorded_and_not_touched(line):
    seen: list[CellCheck] = []
    checks = check_cells(cells(line), progress=seen.append, signature=Signature(operator="4711"))
    assert [check.cell for check in checks] == list(line)
    assert {*states(checks).values()} == {WELL}
    assert sorted(seen, key=lambda check: check.cell) == list(checks)
    assert {name: one.well for name, one in on_record().items()} == dict.fromkeys(line, True)
    assert on_record()["press-1"].signature.operator == "4711"
    names = {one.controller for one in on_record().values()}
    assert len(names) == 4
    assert all(name.startswith("epson:") for name in names)
    assert open_journal().verify().problems == ()
    for simulator in line.values():
        requests = [text for _, way, text in simulator.log if way == ">"]
        assert changes(requests) == []
        assert requests[-1].startswith("$Logout")


def test_cells_that_are_off_keep_no_other_from_being_checked(line, silent):
    off = ["epson+tcp://127.0.0.1:1", silent]

    def connect(cell):
        if isinstance(cell, str):
            return robolink.connect(cell, timeout_s=0.3)
        return robolink.connect(cell.url)

    checks = check_cells([*off, *cells(line)], connect=connect)
    assert [check.state for check in checks] == [FAILED, FAILED, WELL, WELL, WELL, WELL]
    assert [why(check).kind for check in checks[:2]] == ["ConnectError", "ConnectError"]
    assert all(check.seconds < 3 for check in checks)
    (first, second) = [one for one in open_journal().checks() if not one.well]
    assert {first.controller, second.controller} == set(off)
    assert first.details["error"] == "ConnectError"


def test_cells_that_are_off_hold_no_place_of_those_that_answer(line, silent):
    """Of two places the six in front, which never answer, would have both for nine seconds."""
    order: list[str] = []
    checks = check_cells(
        [*[silent] * 6, *cells(line)],
        at_once=2,
        connect=lambda cell: robolink.connect(cell if isinstance(cell, str) else cell.url),
        progress=lambda check: order.append(check.cell),
    )
    assert sorted(order[:4]) == sorted(line)
    assert [check.state for check in checks] == [FAILED] * 6 + [WELL] * 4
    assert {why(check).kind for check in checks[:6]} == {"ConnectError"}


def test_only_a_connection_that_is_long_in_coming_makes_room_for_another_cell():
    clock = ManualClock()
    slots = CheckSlots(2, 14, clock)
    assert [slots.take() for _ in range(3)] == [True, True, False]
    with slots.aside():
        assert not slots.take()  # it is there in a moment, as a rule
        clock.advance(0.11)
        assert slots.take()
        assert not slots.take()
    slots.leave()
    assert not slots.take()  # who was connected late is let in, and counts
    slots.leave()
    assert slots.take()


@pytest.mark.parametrize(("files", "most"), [(256, 128), (64, 64), (-1, 512)], ids=str)
def test_no_more_cells_are_waited_for_than_the_process_has_files(monkeypatch, files, most):
    resource = pytest.importorskip("resource")
    monkeypatch.setattr(resource, "getrlimit", lambda _which: (files, resource.RLIM_INFINITY))
    monkeypatch.setattr(resource, "RLIM_INFINITY", -1)
    clock = ManualClock()
    slots = CheckSlots(64, most_aside(64), clock)
    with ExitStack() as stack:
        begun = 0
        while begun < 1000 and slots.take():
            stack.enter_context(slots.aside())
            clock.advance(0.11)
            begun += 1
    assert begun == most


def test_a_cell_whose_lease_somebody_has_is_busy_and_is_not_connected_to(line):
    check_cells(cells(line))  # they are known from here on
    url = find_cell("press-2").url
    own = this_process()
    holder = LeaseHolder(os_user="ann", host="pc-7", pid=own.pid, boot=own.boot)
    asked = len(line["press-2"].log)
    with open_journal().log(url, holder=holder).hold("a needle change"):
        checks = check_cells(cells(line))
    assert states(checks) == {**dict.fromkeys(line, WELL), "press-2": BUSY}
    assert "a needle change" in why(checks[1]).what
    assert "ann" in why(checks[1]).what
    assert why(checks[1]).kind == "BusyError"
    assert len(line["press-2"].log) == asked
    assert on_record()["press-2"].details["error"] == "BusyError"


def test_a_cell_that_a_process_here_has_is_busy_by_name(line):
    url = find_cell("press-3").url
    with (
        robolink.connect(url) as controller,
        StopListener(controller, url, who="ann ('robolink jog')") as listener,
    ):
        # A card of this process is its own; the name of the file says whose it is.
        card = listener._card
        card.rename(card.with_name(f"{os.getppid()}-other.json"))
        checks = check_cells(cells(line))
        card.with_name(f"{os.getppid()}-other.json").rename(card)
    assert states(checks) == {**dict.fromkeys(line, WELL), "press-3": BUSY}
    assert "ann ('robolink jog') is working on it." in why(checks[2]).what


def test_a_login_that_nobody_here_has_is_told_as_what_it_is(line):
    with robolink.connect(find_cell("press-1").url):
        (check,) = check_cells(cells(line)[:1])
    assert (check.state, why(check).kind) == (FAILED, "LoginUnansweredError")


def test_a_check_takes_no_lease_and_no_mailbox_so_a_change_goes_on(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    with serve_modbus_tcp(SoftMotionSimulator(seed=3)) as host:

        def tools(controller):
            with robolink.connect(host.url) as other:
                other.tools.write(2, ToolOffset(5, 6, -70), expected=None)
            return read_tools(controller)

        check = check_cell(host.url, tools=tools)
    assert check.state is WELL
    assert check.inspection is not None
    assert check.inspection.tools[2] == ToolOffset(5, 6, -70)


def test_a_stop_from_another_terminal_reaches_the_cell_that_is_checked(line):
    told = []
    url = find_cell("press-2").url

    def tools(controller):
        if controller.identity == url:
            (holder,) = holders_of(far_end_of(url))
            assert "a check of cells" in holder.who
            told.append(holder.ask_to_stop("K. Sato"))
        return read_tools(controller)

    heard: list[str] = []
    checks = check_cells(cells(line), tools=tools, tell=heard.append)
    assert states(checks) == {**dict.fromkeys(line, WELL), "press-2": FAILED}
    assert why(checks[1]).kind == "StoppedError"
    assert told == ["ready"]
    assert any("stopped from another terminal by K. Sato" in one for one in heard)
    assert list(holders_of(far_end_of(url))) == []


def test_a_command_waits_for_the_check_of_its_cell(line, capsys):
    """A change is not kept out by the login of a check that another process makes."""
    url, checked = find_cell("press-2").url, threading.Event()
    commands: list[threading.Thread] = []
    codes: list[int] = []

    def tools(controller):
        if controller.identity == url:
            (holder,) = holders_of(far_end_of(url))
            other = holder.card.with_name(f"{os.getppid()}-other.json")
            other.write_bytes(holder.card.read_bytes())  # as another process would see it
            beside = threading.Thread(target=lambda: codes.append(set_tool()))
            commands.append(beside)
            beside.start()
            assert not checked.wait(0.2)
            assert codes == []
            other.unlink()
        return read_tools(controller)

    def set_tool():
        return main.run(["-c", "press-2", "--wait", "5", "tool", "set", "1", "--x", "12.5"])

    assert {*states(check_cells(cells(line), tools=tools)).values()} == {WELL}
    for beside in commands:
        beside.join(30)
    assert codes == [0]


def test_a_cell_that_takes_too_long_is_told_and_waited_for_no_longer(line):
    slow, release = find_cell("press-1").url, threading.Event()

    def tools(controller):
        if controller.identity == slow:
            assert release.wait(30)
        return read_tools(controller)

    def progress(check):
        if check.cell == "press-1":
            release.set()

    checks = check_cells(cells(line), tools=tools, deadline_s=0.3, progress=progress)
    assert states(checks) == {**dict.fromkeys(line, WELL), "press-1": FAILED}
    assert why(checks[0]).what == "The check took longer than 0.3 s."
    assert not on_record()["press-1"].well


def test_ctrl_c_ends_it_in_order_and_what_was_finished_is_on_record(line):
    def progress(check):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        check_cells(cells(line), progress=progress, at_once=2)
    assert 1 <= len(on_record()) <= 2
    for simulator in line.values():
        requests = [text for _, way, text in simulator.log if way == ">"]
        assert not requests or requests[-1].startswith("$Logout")
    assert not [one for one in threading.enumerate() if one.name.startswith("robolink-check")]


def test_a_journal_that_cannot_be_used_fails_each_check_by_name(line, monkeypatch, tmp_path):
    monkeypatch.setenv("ROBOLINK_JOURNAL", str(tmp_path))
    checks = check_cells(cells(line))
    assert {why(check).kind for check in checks} == {"JournalError"}


def test_the_record_is_read_once_for_a_cell_and_not_for_each_of_its_tools(line, monkeypatch):
    """With a query for each tool it was three quarters of what a check cost."""
    chosen = cells(line)
    with robolink.connect(chosen[0].url) as controller:
        controller.tools.write(2, ToolOffset(5, 6, -70), expected=None)
    line["press-1"].machine.tools.set(2, ToolOffset(5, 6, -71))
    check_cells(chosen)
    asked, rows = [], DatabaseConnection.rows

    def counted(connection, statement, *values):
        asked.append(statement)
        return rows(connection, statement, *values)

    monkeypatch.setattr(DatabaseConnection, "rows", counted)
    checks = check_cells(chosen)
    assert checks[0].inspection is not None
    assert [one.subject for one in checks[0].inspection.findings] == ["2"]
    assert len([one for one in asked if "FROM entries WHERE" in one]) <= 3 * len(chosen)
    assert len(asked) <= 32 * len(chosen)


def test_cells_that_are_met_first_are_noted_together_and_not_one_after_the_other(line, monkeypatch):
    """A commit each, while others wait for the journal, took a quarter of 2,000 first checks."""
    open_journal()
    stored, commit = [], DatabaseConnection.commit

    def counted(connection):
        stored.append(connection)
        commit(connection)

    monkeypatch.setattr(DatabaseConnection, "commit", counted)
    assert {*states(check_cells(cells(line))).values()} == {WELL}
    assert len(stored) == 2  # whom it met, and the checks
    addresses = [parse_url(one.url).address for one in cells(line)]
    noted = [open_journal().names_of(address)[0] for address in addresses]
    assert noted == [on_record()[name].controller for name in line]
    check_cells(cells(line))
    assert len(stored) == 3


def change_unseen(record, machine):
    """Put a value on record, as a change does, and another one into the controller."""
    value = ToolOffset(1, 2, 3)
    record.begin(Marker("a", MarkerKind.SET, "TLSet 1", wall_label(), {"tool": 1}))
    details = {"value": plain_offset(value), "before": None, "requested": plain_offset(value)}
    record.clear("a", NewEntry(EntryKind.DONE, operation="a", tool=1, details=details))
    record.close()
    machine.tools.set(1, ToolOffset(1, 2, 29))


def found_by_two_checks(url):
    """Return the codes of what the first check finds, and of what the next one does."""
    checks = [check_cells([url])[0].inspection for _ in range(2)]
    return [[str(one.code) for one in check.findings] for check in checks if check]


def test_the_first_check_sees_what_is_on_record_under_the_address(line):
    """It found no problem with a tool that was 26 mm off; only the second check did."""
    simulator = EpsonSimulator(seed=9)
    with serve_serial(simulator) as host:  # a port of this computer is lent, and nobody's record
        address = parse_url(host.url).address
        change_unseen(open_journal().log(address), simulator.machine)
        assert found_by_two_checks(host.url) == [["tool_changed"]] * 2


def test_robots_that_are_new_are_on_record_before_anything_is_compared(line):
    simulator = EpsonSimulator("GX4-C351S,C8-C901SR", seed=9)
    with serve_tcp(simulator) as host:
        address = parse_url(host.url).address
        known: list[tuple[str, ...]] = []

        def tools(controller):
            assert controller.outcomes.open_markers() == ()
            known.append(open_journal().robots_of(address))
            return read_tools(controller)

        for _ in range(2):
            (check,) = check_cells([host.url], tools=tools)
            assert check.state is WELL
    first, again = known
    assert len(first) == 2
    assert first == again


def test_one_controller_at_two_new_addresses_is_told_once(line):
    """Neither was on record when the other was met."""
    told: list[str] = []
    with serve_tcp(line["press-1"]) as again:
        chosen = [*cells(line), again.url]
        for _ in range(2):  # one after the other, as it serves one client at a time
            checks = check_cells(chosen, at_once=1, tell=told.append)
            assert {check.state for check in checks} == {WELL}
    assert len([one for one in told if "one controller, one record" in one]) == 1
    (entry,) = open_journal().entries(kinds=[EntryKind.IDENTITY])
    assert "one controller, one record" in entry.verdict


def test_who_cannot_be_noted_keeps_no_other_off_the_record(line, tmp_path):
    addresses = [parse_url(one.url).address for one in cells(line)]
    open_journal()
    with closing(sqlite3.connect(tmp_path / "state" / "journal.db")) as database:
        database.execute(
            "CREATE TRIGGER damaged BEFORE INSERT ON addresses "
            f"WHEN NEW.address = '{addresses[1]}' BEGIN SELECT RAISE(ABORT, 'damaged'); END"
        )
    assert {*states(check_cells(cells(line))).values()} == {WELL}
    noted = [open_journal().names_of(address)[0] != address for address in addresses]
    assert noted == [True, False, True, True]


def test_a_name_that_is_no_cell_is_refused_before_any_is_asked(line):
    with pytest.raises(ConfigError, match="no cell 'press-9'"):
        check_cells(["press-1", "press-9"])
    assert [len(simulator.log) for simulator in line.values()] == [0, 0, 0, 0]


def test_a_check_is_compared_by_its_result_and_not_by_its_time(line):
    check = check_cell("press-1")
    assert isinstance(check, CellCheck)
    assert check == replace(check, seconds=99.0)
    assert check.well


def test_a_journal_that_takes_no_checks_is_asked_once_for_all_of_them(line, monkeypatch):
    """A second attempt would wait for each cell, or store what was stored once more."""
    check_cells(cells(line))
    asked, record = [], Journal.record_checks

    def recorded(journal, checks, **terms):
        asked.append(len(checks))
        record(journal, checks, **terms)

    monkeypatch.setattr(Journal, "record_checks", recorded)
    run(open_journal(), "DELETE FROM check_head")
    checks = check_cells(cells(line))
    assert (asked, [why(check).kind for check in checks]) == ([4], ["JournalError"] * 4)


def test_a_cell_whose_record_was_moved_keeps_no_other_from_being_recorded(line, tmp_path):
    check_cells(cells(line))
    for one in on_record().values():
        open_journal().log(one.controller).append(NewEntry(EntryKind.DECISION))
    own = {name: str(tmp_path / f"{name}.db") for name in ("press-1", "press-3")}
    for name, place in own.items():
        move_journal(place, controller=on_record()[name].controller)
    checks = check_cells(cells(line))
    assert states(checks) == {**dict.fromkeys(line, WELL), **dict.fromkeys(own, FAILED)}
    for check in checks[0], checks[2]:
        assert (why(check).kind, own[check.cell] in why(check).what) == ("JournalError", True)
    assert len(list(open_journal().checks())) == 4 + 2


def test_the_kind_of_a_failure_is_an_error_that_everybody_can_name():
    error = ChainConflictError("It is another one.", plant_end=(1, "ab"))
    assert CheckFailure.of(error).kind == "JournalError"
    assert CheckFailure.of(BusyError("It is at work.")) == CheckFailure(
        "BusyError", "It is at work.", busy=True
    )
