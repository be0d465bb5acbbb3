"""check-contract ended in the middle restores the tool and reports how far it came."""

import json
import signal
import sys
from types import SimpleNamespace
from typing import TYPE_CHECKING, cast
from xml.etree import ElementTree

import pytest
from robolink_cli import main
from robolink_cli.commands.controller.contract_report import TrialConnections
from robolink_simulators.faults import Fault, FaultAction

import robolink
from robolink.checkpoints import observed
from robolink.errors import LoginUnansweredError, StoppedError
from robolink.journal import memory_journal
from robolink.model import Controller, ToolOffset
from robolink.testing import (
    MOVING_CHECKS,
    READING_CHECKS,
    WRITING_CHECKS,
    WRITING_WHILE_MOVING_CHECKS,
    kept_on_site,
    on_site,
)

if TYPE_CHECKING:
    from robolink_cli.session.context import CliContext

EVERY = (*READING_CHECKS, *WRITING_CHECKS, *MOVING_CHECKS, *WRITING_WHILE_MOVING_CHECKS)
OLD = ToolOffset(1.0, 2.0, 3.0)
ALL = ("--write", "--tool", "2", "--move", "--yes")
CODES = {signal.SIGINT: 130, signal.SIGTERM: 143}


class Cell:
    """A simulated cell whose tool 2 the checks may write, and the file for pipelines."""

    def __init__(self, cell, folder, capsys):
        self.fixture, self.report, self._capsys = cell, folder / "contract.xml", capsys
        with robolink.connect(cell.url) as controller:
            controller.tools.write(2, OLD, expected=robolink.ANY)
        self.before = self.kept()

    def kept(self):
        truth = self.fixture.truth()
        return truth["stored"], truth["selected_tool"]

    def open_markers(self):
        with robolink.connect(self.fixture.url) as controller:
            return controller.outcomes.open_markers()

    def run(self, *told):
        line = ["-c", self.fixture.url, "check-contract", *told, "--junit", str(self.report)]
        code = main.run(line)
        shown = self._capsys.readouterr()
        return code, shown.out, shown.err

    def cases(self):
        """Return name and kind of each case in the file for pipelines."""
        suite = ElementTree.fromstring(self.report.read_bytes())
        return [(case.get("name"), case[0].tag if len(case) else "kept") for case in suite]

    def end_of_report(self):
        """Count the incomplete cases: the one that ended the run, and those after it."""
        kinds = [kind for _, kind in self.cases()]
        return kinds.count("error"), kinds.count("skipped")


@pytest.fixture(params=["epson", "softmotion"])
def cell(request, robolink_state, tmp_path, capsys):
    return Cell(request.getfixturevalue(f"{request.param}_sim"), tmp_path, capsys)


@pytest.fixture
def epson(epson_sim, robolink_state, tmp_path, capsys):
    return Cell(epson_sim, tmp_path, capsys)


class Signals:
    """Raises a signal at one of the points that the command passes, and counts the points."""

    def __init__(self, number=None, *, at=0):
        self.number, self.at, self.logins = number, at, []
        self.passed = 0

    def __call__(self, point, what):
        self.passed += 1
        if what == "Login":
            self.logins.append(self.passed)
        if self.passed == self.at:
            signal.raise_signal(self.number)


COUNTED: dict[tuple[str, ...], Signals] = {}


def counted(cell, *told):
    """Return the points that a whole run passes, which are the same at each cell of a kind."""
    key = (cell.fixture.url.partition(":")[0], *told)
    if key not in COUNTED:
        with observed(counting := Signals()):
            assert cell.run(*told)[0] == 0
        COUNTED[key] = counting
    return COUNTED[key]


def ended(cell, number, at, *told):
    with observed(Signals(number, at=at)):
        return cell.run(*told)


@pytest.mark.parametrize(
    "every",
    [
        pytest.param(1511, id="few"),
        pytest.param(311, id="sample", marks=pytest.mark.soak),
        pytest.param(7, id="each", marks=pytest.mark.soak),
    ],
)
def test_a_signal_at_any_moment_leaves_all_as_it_was_and_says_so(cell, every):
    for turn, at in enumerate(range(60, counted(cell, *ALL).passed, every)):
        number = list(CODES)[turn % 2]
        cell.report.write_text("of before")
        code, out, err = ended(cell, number, at, *ALL, "--json")
        document = json.loads(out)
        assert (code, document["exit_code"]) == (CODES[number], CODES[number]), (at, out)
        assert cell.kept() == cell.before, at
        assert cell.open_markers() == (), at
        assert document["error"]["controller_state"] == "unchanged", (at, err)
        last = err.splitlines()[-1]
        assert last.endswith("Tool 1 is selected."), (at, last)
        assert "now" not in last, (at, last)
        assert "recover" not in last, (at, last)
        assert cell.end_of_report()[0] == 1, (at, cell.cases())
        assert len(cell.cases()) in (len(EVERY), len(EVERY) + 1)


def test_what_moved_before_is_not_denied(epson):
    logins = counted(epson, "--move", "--yes").logins
    # The login of the last check: no connection has moved anything yet.
    _, _, err = ended(epson, signal.SIGINT, logins[-3], "--move", "--yes")
    assert "\n  Every movement has ended. Nothing was written." in err


def test_a_signal_while_it_is_put_back_waits_for_that(epson):
    logins = counted(epson, *ALL).logins
    code, _, err = ended(epson, signal.SIGTERM, logins[-1], *ALL)
    assert (code, epson.open_markers()) == (143, ())
    assert f"{len(EVERY)} of {len(EVERY)} checks were made" in err
    assert epson.cases()[-1] == ("what_was_there_is_put_back", "error")


def test_a_reader_reads_what_was_found_before_it_was_ended(epson):
    logins = counted(epson).logins
    code, out, err = ended(epson, signal.SIGINT, logins[-1], "--lang", "en")
    assert (code, out) == (130, "")
    assert "7 of 8 checks were made, 0 failed." in err
    assert epson.cases()[-2:] == [
        ("a_marker_of_somebody_else_is_refused", "kept"),
        ("closing_is_final", "error"),
    ]


def test_a_lost_answer_is_told_as_what_it_was_once_the_old_value_was_read(epson):
    fault = Fault(FaultAction.DROP_REPLY, match="TLSet 2, XY")
    epson.fixture.simulator.faults.add(fault)
    code, out, err = epson.run(*ALL, "--json")
    error = json.loads(out)["error"]
    assert (code, error["kind"], error["controller_state"]) == (
        3,
        "TransportTimeoutError",
        "unchanged",
    )
    assert "recover" not in error["remedy"]
    assert "a write is read back: No clear answer came" in err
    assert f"{len(READING_CHECKS)} of {len(EVERY)} checks were made, 0 failed." in err
    assert (epson.kept(), epson.open_markers()) == (epson.before, ())
    assert epson.end_of_report() == (1, len(EVERY) - len(READING_CHECKS) - 1)


def test_a_movement_whose_link_is_cut_ends_before_anything_is_put_back(epson):
    epson.fixture.simulator.faults.add(Fault(FaultAction.DISCONNECT, match="Move "))
    code, _, err = epson.run(*ALL)
    assert (code, epson.open_markers()) == (3, ())
    assert not epson.fixture.simulator.status_flags().running
    assert "\n  Every movement has ended. Tool 2 holds" in err


def test_a_plc_that_takes_a_lost_check_for_its_owner_is_waited_for(
    softmotion_sim, robolink_state, tmp_path, capsys
):
    cell = Cell(softmotion_sim, tmp_path, capsys)
    # Its first write of the tool is carried out, and the link fails before the answer.
    softmotion_sim.do("add_fault", action="disconnect", match="write_command WRITE_TOOL")
    code, _, err = cell.run(*ALL)
    assert (code, cell.open_markers()) == (3, ()), err
    assert cell.kept() == cell.before
    assert "as before. Tool 1 is selected.\n" in err


@pytest.mark.parametrize("document", [True, False])
def test_what_could_not_be_put_back_is_named_and_recover_knows_of_it(epson, document):
    faults = epson.fixture.simulator.faults
    # The second write, which restores the old value, is lost, and so are all that follow it.
    for nth in range(1, 12):
        faults.add(Fault(FaultAction.DISCONNECT_BEFORE, match="TLSet 2, XY", on_exchange=nth))
    code, out, err = epson.run(*ALL, *(["--json"] if document else []))
    assert code == 6
    if document:
        error = json.loads(out)["error"]
        stands = error["stands"]
        assert (error["controller_state"], stands["left_open"]) == ("unknown", True)
        assert stands["tools"]["2"]["before"]["x_mm"] == 1.0
        assert stands["tools"]["2"]["known"] is False
    else:
        *_, stands, last = err.splitlines()
        assert "Tool 2 may hold the new value X 1.000" in stands
        assert last.endswith("Next: robolink recover.")
    assert epson.end_of_report() == (1, len(EVERY) - len(READING_CHECKS) - 1)
    faults.clear()
    assert main.run(["-c", epson.fixture.url, "recover", "--yes"]) == 0
    assert epson.kept() == epson.before


def test_the_file_for_pipelines_is_refused_before_anything_is_asked(epson, tmp_path):
    epson.report = tmp_path / "folder"
    epson.report.mkdir()
    before = epson.fixture.simulator.counters()["exchanges"]
    code, _, err = epson.run()
    assert (code, "folder" in err) == (2, True)
    assert epson.fixture.simulator.counters()["exchanges"] == before


@pytest.fixture
def trials(epson):
    context = SimpleNamespace(
        require_url=lambda: epson.fixture.url,
        timeout_s=3.0,
        remote_timeout_s=60.0,
        record=None,
        password_file=None,
        cell=None,
        reach=None,
    )
    trials = TrialConnections(cast("CliContext", context))
    yield trials
    trials.close()


def test_a_stop_between_two_checks_stops_the_controller_and_ends_them(epson, trials):
    with trials.connect():
        pass
    epson.fixture.wire.assert_not_sent("$Abort")
    trials.stop()
    epson.fixture.wire.assert_sent("$Abort")
    assert trials.status().ready
    with pytest.raises(StoppedError, match="stopped from another terminal"):
        trials.connect()


def test_a_stop_during_a_check_goes_over_its_connection(epson, trials):
    with trials.connect() as controller:
        trials.stop()
        assert controller.latch.closed
    with pytest.raises(StoppedError):
        trials.connect()


def test_whoever_stopped_the_checks_may_have_the_login_when_it_is_put_back(epson, monkeypatch):
    monkeypatch.setattr(on_site, "_AGAIN_S", 0.0)
    refusals = [LoginUnansweredError("Somebody has it."), LoginUnansweredError("Still.")]
    begun: list[Controller] = []

    def reach(*, leaves):
        if not leaves and refusals:
            raise refusals.pop()
        return robolink.connect(epson.fixture.url)

    own = memory_journal("a trial").log("a trial")
    with kept_on_site(reach, "a trial", tool=2, agree=begun.append):
        with robolink.connect(epson.fixture.url, outcomes=own) as controller:
            controller.tools.write(2, ToolOffset(7.0), expected=OLD)
    assert (len(begun), refusals) == (1, [])
    assert (epson.kept(), epson.open_markers()) == (epson.before, ())


DRIVER = """
import sys
from robolink.controllers import SimpleController, SimpleMachine

class Speechless(Exception):
    def __str__(self):
        raise ValueError

class Ends(SimpleMachine):
    def read(self, tool):
        sys.exit(0)

class Garbled(SimpleMachine):
    def read(self, tool):
        raise ValueError("\\x00\\ud800\\x1b[31m")

class Silent(SimpleMachine):
    def read(self, tool):
        raise Speechless

def of(machine):
    return lambda: SimpleController(machine, identity="memory+object://mine")

ends, garbled, silent = of(Ends()), of(Garbled()), of(Silent())

def none_for_a_while():
    raise KeyError("no cable")
"""


@pytest.fixture
def driver(monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "drv_that_ends.py").write_text(DRIVER, encoding="utf-8")
    (tmp_path / "drv_exits.py").write_text("import sys\nsys.exit(0)\n", encoding="utf-8")
    (tmp_path / "drv_wrong.py").write_text("def broken(:\n", encoding="utf-8")

    def run(name, *told):
        code = main.run(["check-contract", "--junit", "it.xml", *told, "--driver", name])
        shown = capsys.readouterr()
        return code, shown.out, shown.err

    yield run
    for name in ("drv_that_ends", "drv_exits", "drv_wrong"):
        sys.modules.pop(name, None)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("ends", "SystemExit at drv_that_ends.py:11 is no RobolinkError: 0"),
        ("garbled", "is no RobolinkError: \\x00\\ud800\\x1b[31m"),
        ("silent", "Speechless at drv_that_ends.py:19 is no RobolinkError: (it has no text)"),
    ],
)
def test_whatever_a_driver_raises_is_a_broken_promise_in_every_report(
    driver, tmp_path, name, words
):
    code, out, _ = driver(f"drv_that_ends:{name}")
    assert (code, words in out) == (1, True), out
    suite = ElementTree.fromstring((tmp_path / "it.xml").read_bytes())
    failures = [case[0].get("message") for case in suite if len(case)]
    assert any(words in (message or "") for message in failures), failures


@pytest.mark.parametrize(
    ("name", "told", "words"),
    [
        ("drv_exits:x", (), "cannot be loaded: SystemExit: 0"),
        ("drv_wrong:x", (), "cannot be loaded: SyntaxError"),
        ("drv_that_ends:none_for_a_while", (), "returned no controller: KeyError"),
        (
            "drv_that_ends:none_for_a_while",
            ("--write", "--tool", "3", "--yes"),
            "returned no controller: KeyError",
        ),
    ],
)
def test_a_driver_that_cannot_be_had_is_no_defect_of_robolink(driver, tmp_path, name, told, words):
    code, _, err = driver(name, *told)
    assert (code, words in err) == (2, True), err
    suite = ElementTree.fromstring((tmp_path / "it.xml").read_bytes())
    assert (suite.get("errors"), suite[0][0].tag) == ("1", "error")
