"""Recovery of a cell as one call: what is closed and how, what is left, who said so."""

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

import robolink
from robolink.config import add_cell
from robolink.errors import ConfigError, LeaseHeldError
from robolink.inspection import recover_cell
from robolink.journal import LeaseHolder, open_journal
from robolink.journal._lease_view import this_process
from robolink.model import EntryKind, Finding, MarkerKind, Verdict, plain_offset
from robolink.stopping import holders_of
from robolink.transport import far_end_of
from tests.faults._requests import changes


@pytest.fixture
def line3(tmp_path, monkeypatch):
    """A cell over TCP; gives the simulator, and its URL."""
    file = tmp_path / "robolink.toml"
    monkeypatch.setenv("ROBOLINK_CONFIG", str(file))
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    simulator = EpsonSimulator(seed=1)
    with serve_tcp(simulator) as host:
        add_cell(file, "line3", {"url": host.url})
        yield simulator, host.url


def interrupted(url, kind, request, details):
    """Leave a job unfinished, as a killed process does."""
    with robolink.connect(url) as controller:
        return controller.begin(kind, request, details)


def written(simulator):
    return changes([text for _, way, text in simulator.log if way == ">"])


def test_a_cell_without_an_interrupted_job_is_left_as_it_is(line3):
    simulator, _ = line3
    found = recover_cell("line3")
    assert (found.cell, found.settled, found.left, found.selected_tool) == ("line3", (), (), 1)
    assert found.recovered
    assert written(simulator) == []


def test_an_untested_value_goes_back_with_one_write_and_is_told_as_that(line3):
    simulator, url = line3
    with robolink.connect(url) as controller:
        before = controller.tools.read(1)
        assert before is not None
        new = before.__class__(before.x_mm + 0.4, *before.components()[1:])
        controller.tools.write(1, new, expected=before)
    tools = {"1": {"before": plain_offset(before), "requested": plain_offset(new)}}
    interrupted(url, MarkerKind.CHANGE, "change tool 1", {"tools": tools, "verify": True})
    simulator.log.clear()
    found = recover_cell("line3")
    (settled,) = found.settled
    assert (settled.verdict, found.left) == (Verdict.NOT_FINISHED, ())
    assert settled.action == "Restore the old value of tool 1"
    assert simulator.machine.tools.get(1).x_mm == before.x_mm
    assert len([text for text in written(simulator) if "TLSet 1," in text]) == 1
    assert recover_cell("line3").settled == ()


def test_what_only_a_person_can_judge_is_left_until_somebody_did_and_that_is_on_record(line3):
    simulator, url = line3
    interrupted(url, MarkerKind.MOVE, "Go P1", {})
    found = recover_cell("line3")
    assert (found.settled, found.recovered) == ((), False)
    (left,) = found.left
    assert left.verdict is Verdict.LOOK
    asked: list[Finding] = []

    def judge(finding):
        (holder,) = holders_of(far_end_of(url))
        assert "(recover)" in holder.who  # a stop from another terminal finds it
        asked.append(finding)
        return True

    found = recover_cell("line3", judge=judge)
    assert [one.marker for one in found.settled] == [left.marker] == [one.marker for one in asked]
    assert open_journal().open_markers() == ()
    (said,) = open_journal().entries(kinds=(EntryKind.DECISION,))
    assert said.details["answered_by"] == "program"
    assert left.sentence in str(said.details["question"])
    assert written(simulator) == []


def test_somebody_at_work_is_not_disturbed(line3):
    _, url = line3
    recover_cell("line3")
    own = this_process()
    ann = LeaseHolder(os_user="ann", host="pc-7", pid=own.pid, boot=own.boot)
    with (
        open_journal().log(url, holder=ann).hold("a needle change"),
        pytest.raises(LeaseHeldError, match="a needle change"),
    ):
        recover_cell("line3")


def test_a_cell_that_is_in_no_file_is_refused(line3):
    with pytest.raises(ConfigError, match="no cell 'line9'"):
        recover_cell("line9")


def test_the_command_and_the_call_recover_alike_and_an_open_controller_stays_open(line3):
    """The command line has connected, and listens, already; each yes is kept by who asked."""
    _, url = line3
    marker = interrupted(url, MarkerKind.MOVE, "Go P1", {})
    told: list[bool] = []
    with robolink.connect(url) as controller:
        found = recover_cell(controller, tell=lambda _finding, closed: told.append(closed))
        assert (found.cell, len(found.left)) == (url, 1)
        assert recover_cell(controller, later=[marker.operation]).left == ()
        found = recover_cell(controller, judge=lambda _finding: True, answered_by=None)
        assert (found.recovered, len(found.settled)) == (True, 1)
        assert list(holders_of(far_end_of(url))) == []
        assert controller.status().ready
    assert told == [False]
    assert list(open_journal().entries(kinds=(EntryKind.DECISION,))) == []
