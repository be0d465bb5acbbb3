"""A running SPEL+ program calls back over real sockets: a tested value is kept, else the old tool.

Both ends are real: companions/epson/recal.prg in the simulated controller, and the server.
"""

from contextlib import closing

import pytest
from robolink_simulators.testkit.program_calls import CallFault

from robolink.journal import open_journal
from robolink.journal._journal_loss import leave_trace
from robolink.model import EntryKind, ToolOffset
from robolink.protocols.spel_callback import CallbackLine, CallbackWord, encode_line
from robolink.serving import CallbackConversation, CallbackLimits
from tests.faults._callback_cell import CONTACT, MEASURED, PROVED, CallbackCell

KINDS = ("cut_before", "cut_after", "drop_question", "drop_answer", "bend_question", "bend_answer")
QUESTIONS = 14
AFTER_SOLVE = range(7, QUESTIONS)


@pytest.fixture
def cell(tmp_path):
    made = CallbackCell(tmp_path)
    made.change_needle()
    yield made
    made.close()


def kinds_of(cell):
    return [entry.kind for entry in reversed(cell.entries())]


def require_sound(cell, old):
    """The tool is the old one, or a new one, tested and right; and the record says which."""
    if cell.tool.rounded(3) != old.rounded(3):
        assert EntryKind.VERIFY in kinds_of(cell)
        assert cell.error_mm < 0.02
    if cell.open_markers():
        return
    ends = (EntryKind.DONE, EntryKind.ROLLED_BACK, EntryKind.NOT_APPLIED)
    last = next((entry for entry in cell.entries() if entry.kind in ends), None)
    if last is not None:
        assert ToolOffset(*last.details["value"]).rounded(3) == cell.tool.rounded(3)


def test_a_needle_is_measured_written_proved_kept_and_on_record(cell):
    before = cell.error_mm
    assert before > 0.2
    assert cell.run() == ["kept"]
    assert cell.error_mm < 0.01
    assert kinds_of(cell) == [
        EntryKind.INTENT,
        EntryKind.CALIBRATION,
        EntryKind.WRITE,
        EntryKind.VERIFY,
        EntryKind.DONE,
    ]
    done = cell.entries(EntryKind.DONE)[0]
    assert ToolOffset(*done.details["value"]) == cell.tool.rounded(3)
    assert len({entry.change for entry in cell.entries()} - {""}) == 1
    assert cell.open_markers() == []
    assert cell.journal.verify().problems == ()
    # No line is longer than a string of a program.
    assert max(map(len, cell.calls.questions + cell.calls.answers)) <= 255


def test_it_works_with_any_control_device(cell):
    """The program calls; nothing is sent to the controller, whatever device starts it.

    Pendant, PC, remote I/O, Remote Ethernet: docs/reference/spel.md 9.
    """
    for device in (20, 21, 22, 26):
        cell.change_needle()
        cell.simulator.machine.control_device = device
        cell.simulator.panel.set_monitoring_only(device != 26)
        assert cell.run() == ["kept"]
        assert cell.error_mm < 0.01
    assert cell.simulator.exchanges == 0
    assert not cell.simulator.log


def refused(cell, code, kinds):
    """Check that the old tool stays, and that the journal gives the reason."""
    old = cell.tool
    assert cell.run() == [code]
    assert cell.tool.rounded(3) == old.rounded(3)
    assert kinds_of(cell) == kinds
    assert cell.entries(EntryKind.REFUSED)[0].details["code"] == code
    assert cell.open_markers() == []


WRITTEN = [
    EntryKind.INTENT,
    EntryKind.CALIBRATION,
    EntryKind.WRITE,
    EntryKind.REFUSED,
    EntryKind.ROLLED_BACK,
]


def test_a_touch_that_no_contact_saw_gets_no_value(cell):
    cell.teach(13, MEASURED[2:3], off_mm=1.0)
    refused(cell, "touches_not_witnessed", [EntryKind.REFUSED])


def test_a_contact_that_is_always_on_saw_nothing(cell):
    world = cell.simulator.world
    world.disconnect(CONTACT)
    cell.simulator.machine.inputs.set(CONTACT, on=True)
    refused(cell, "touches_not_witnessed", [EntryKind.REFUSED])


def test_a_proof_that_no_contact_saw_puts_the_old_value_back(cell):
    cell.teach(22, PROVED[1:], off_mm=1.0)
    refused(cell, "touches_not_witnessed", WRITTEN)


def test_a_proof_by_the_poses_of_the_measurement_proves_nothing(cell):
    points = cell.simulator.machine.points
    for number, copied in ((21, 11), (22, 14)):
        points.store(number, points.get(copied))
    refused(cell, "proof_is_a_copy", WRITTEN)


def test_a_pin_that_was_bumped_between_measurement_and_proof_is_found(cell):
    """Both parts agree in themselves; only together do they show the bump."""
    x, y, z = cell.simulator.world.pin_mm
    cell.simulator.world.pin_mm = (x + 0.15, y, z)
    cell.teach(21, PROVED)
    refused(cell, "point_moved", WRITTEN)


def test_a_change_that_no_needle_makes_is_refused(cell):
    true = cell.simulator.world.tips[1]
    cell.simulator.world.tips[1] = ToolOffset(true.x_mm + 3, true.y_mm, true.z_mm)
    cell.teach(11, MEASURED)
    refused(cell, "implausible_change", [EntryKind.REFUSED])


def test_touches_that_scatter_are_refused(cell):
    cell.teach(11, MEASURED, noise_mm=0.15)
    old = cell.tool
    (code,) = cell.run()
    assert code in {"uncertain", "sigma_contradicted", "touches_not_witnessed"}
    assert cell.tool == old


def test_a_program_that_is_to_stop_after_a_refusal_stops(tmp_path):
    made = CallbackCell(tmp_path, main=_stopping())
    made.change_needle()
    made.teach(13, MEASURED[2:3], off_mm=1.0)
    with pytest.raises(AssertionError, match="8101"):
        made.run()
    made.close()


def _stopping():
    from tests.faults._callback_cell import MAIN

    return MAIN.replace("RobolinkRestore\n", "RobolinkRestore\n  rl_stop = 1\n", 1)


def test_without_a_server_the_program_goes_on_with_the_old_tool(cell):
    cell.calls.fault = lambda _number, _line: CallFault(cut_before=True)
    old = cell.tool
    assert cell.run() == ["no_answer"]
    assert cell.tool == old


def disturbed(tmp_path, number, kind):
    """Disturb one exchange, then run the program again undisturbed."""
    cell = CallbackCell(tmp_path)
    try:
        cell.change_needle()
        old = cell.tool
        cell.calls.fault = lambda at, _line: CallFault(**{kind: True}) if at == number else None
        cell.run()
        require_sound(cell, old)
        cell.change_needle()
        old = cell.tool
        assert cell.run() == ["kept"]
        require_sound(cell, old)
        assert cell.tool != old
        assert cell.open_markers() == []
    finally:
        cell.close()


@pytest.mark.parametrize(
    ("number", "kind"),
    [
        (7, "drop_answer"),
        (11, "bend_answer"),
        (12, "drop_answer"),
        (12, "cut_before"),
    ],
)
def test_a_disturbed_exchange_ends_in_the_old_tool_or_a_proved_new_one(tmp_path, number, kind):
    disturbed(tmp_path, number, kind)


@pytest.mark.soak
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("number", range(QUESTIONS))
def test_every_disturbed_exchange_ends_so(tmp_path, number, kind):
    disturbed(tmp_path, number, kind)


def test_a_value_that_was_bent_on_its_way_is_never_written(cell):
    cell.calls.fault = lambda at, _line: CallFault(bend_answer=True) if at == 7 else None
    written = cell.simulator.machine.flash_writes
    assert cell.run() == ["no_answer"]
    assert cell.simulator.machine.flash_writes == written


def test_an_open_change_of_somebody_else_gives_no_value(cell):
    """The PC was the control device before, and a job of its own is open."""
    from robolink.model import Marker, MarkerKind, new_operation

    log = cell.journal.log("epson:SIM00001")
    log.begin(Marker(new_operation(), MarkerKind.SET, "TLSet 1", "2026-01-01T00:00:00Z", {}))
    log.close()
    old = cell.tool
    assert cell.run() == ["unsettled"]
    assert cell.tool == old


def test_a_program_that_claims_to_have_kept_what_nobody_proved_is_not_believed(cell):
    """A flag in the controller's memory is no proof; the change stays open for a person."""
    cell.calls.fault = lambda at, _line: CallFault(cut_before=True) if at == 11 else None
    cell.run()
    assert [marker.kind for marker in cell.open_markers()] == ["change"]
    operation = cell.open_markers()[0].operation
    requested = cell.open_markers()[0].details["tools"]["1"]["requested"]
    lied = CallbackConversation(cell.journal, CallbackLimits(), peer="here")
    values = tuple(str(round(value * 1000)) for value in requested)
    fields = ("SIM00001", "1", "2", operation, "1", "1", *values)
    answer = lied.answer(CallbackLine(1, CallbackWord.HELLO, fields))
    assert (answer.word, answer.fields) == (CallbackWord.REFUSE, ("conflict",))
    assert len(cell.open_markers()) == 1
    assert encode_line(answer)


def test_a_program_whose_record_is_missing_is_told_that_something_is_unsettled(
    tmp_path, monkeypatch
):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    leave_trace("epson:SIM00001", "journal.db", None)
    tool = ("1", "11425", "-4085", "-20000", "0", "0", "0")
    with closing(open_journal(str(tmp_path / "journal.db"))) as journal:
        talk = CallbackConversation(journal, CallbackLimits(), peer="here")
        hello = talk.answer(
            CallbackLine(1, CallbackWord.HELLO, ("SIM00001", "1", "0", "-", "1", *tool))
        )
        begun = talk.answer(CallbackLine(2, CallbackWord.BEGIN, ("1", "n-angle", *tool)))
        talk.close()
    assert hello.word == CallbackWord.WELCOME
    assert (begun.word, begun.fields) == (CallbackWord.REFUSE, ("unsettled",))
