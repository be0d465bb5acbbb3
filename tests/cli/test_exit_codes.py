"""The end of a command: the documented exit codes and the sentence for each."""

import io
import json
import os
import re
import signal
import sys
from inspect import getsource, unwrap
from pathlib import Path

import click
import pytest
from robolink_cli import main
from robolink_cli.console import exit_codes
from robolink_cli.console.output import watched_output
from robolink_cli.session.connection import open_controller

from robolink import errors
from robolink.controller_outcome import ControllerOutcome, ToolOutcome, note_outcome
from robolink.errors import OutcomeUnknownError
from robolink.interrupts import EndedBy, Interrupted, InterruptGate, ended_by, one_ending
from robolink.model import EntryKind, ToolOffset
from robolink.transaction import ToolChange, Wanted, change_tools

# The documented exit codes are those of the code, and 6 comes first.

_PAGE = Path(__file__).parents[2] / "docs" / "commands.md"
_NAMED = {
    value
    for name, value in vars(exit_codes).items()
    if name.isupper() and isinstance(value, int) and not isinstance(value, bool)
}


def test_the_page_has_the_table_of_the_code():
    table = _PAGE.read_text().split("\n\n**6 overrides")[0]
    rows = re.findall(r"^\| (\d+) \| (.+) \|$", table, re.MULTILINE)
    assert {int(code): meaning for code, meaning in rows} == exit_codes.MEANINGS
    assert [int(code) for code, _ in rows] == sorted(exit_codes.MEANINGS)


def test_every_code_that_a_command_can_end_with_has_a_meaning():
    assert _NAMED | {code for _, code in exit_codes.EXIT_CODES} == set(exit_codes.MEANINGS)


def commands(command, path=()):
    """Yield every command below one, with its name."""
    if not isinstance(command, click.Group):
        yield " ".join(path), command
        return
    context = click.Context(command)
    for name in [*command.list_commands(context), *(["expert"] if command is main.cli else [])]:
        inner = command.get_command(context, name)
        assert inner is not None
        yield from commands(inner, (*path, name))


def test_every_command_that_can_end_with_1_stands_in_its_row():
    ending = {
        name.removeprefix("expert ")
        for name, command in commands(main.cli)
        if "return DIFFERENT" in (source := getsource(unwrap(command.callback)))
        or "else DIFFERENT" in source
    }
    assert "tool compare" in ending
    assert {name for name in ending if f"`{name}`" not in exit_codes.MEANINGS[1]} == set()


OLD, NEW = (12.0, -3.5, -20.0, 0.0, 0.0, 0.0), (12.5, -3.5, -20.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    "error",
    [
        errors.TransportBrokenError("gone"),
        errors.RemoteProtocolError("bent"),
        errors.JournalError("full"),
        errors.VerifyError("drifts"),
        errors.StoppedError("stopped"),
        OSError("no space left"),
        KeyboardInterrupt(),
    ],
    ids=lambda error: type(error).__name__,
)
def test_what_is_not_settled_outranks_whatever_broke_afterwards(error):
    settled = exit_codes.exit_code(error)
    assert settled != 6
    tools = {1: ToolOutcome(before=OLD, holds=NEW, requested=NEW)}
    note_outcome(error, ControllerOutcome(tools=tools, settled=False, left_open=True))
    assert exit_codes.exit_code(error) == 6
    body = exit_codes.error_body(error)
    assert body["controller_state"] == "changed"
    note_outcome(error, ControllerOutcome(tools=tools))
    assert exit_codes.exit_code(error) == settled


# The sentence and the exit code of an ended command; the same for every way to end it.

NEW_BY_END = ToolOffset(1.5, 2.5, 3.5)

CODES = {signal.SIGHUP: 129, signal.SIGINT: 130, signal.SIGTERM: 143}


@pytest.fixture(params=CODES, ids=lambda number: number.name)
def number(request):
    return request.param


@pytest.mark.usefixtures("signals_of_a_terminal")
def test_a_signal_becomes_one_interruption_and_a_second_one_is_not_heard(number):
    before = [signal.getsignal(each) for each in CODES]
    reached = []
    with one_ending():
        with pytest.raises(Interrupted) as raised:
            signal.raise_signal(number)
        assert raised.value.by == ended_by() == EndedBy(number.name)
        for each in CODES:
            signal.raise_signal(each)
        reached.append("the end of the cleaning up")
    assert reached
    assert ended_by() is None
    assert [signal.getsignal(each) for each in CODES] == before


@pytest.mark.usefixtures("signals_of_a_terminal")
def test_it_is_held_back_inside_an_exchange(number):
    gate, reached = InterruptGate(), []
    with one_ending():
        gate.open()
        with pytest.raises(Interrupted), gate:
            signal.raise_signal(number)
            assert gate.interrupted
            reached.append("the end of the exchange")
        gate.close()
    assert reached


@pytest.mark.usefixtures("signals_of_a_terminal")
def test_without_a_command_around_it_a_session_leaves_sigterm_to_the_program():
    gate = InterruptGate()
    gate.open()
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    assert signal.getsignal(signal.SIGHUP) is signal.SIG_DFL
    gate.close()


@pytest.mark.usefixtures("signals_of_a_terminal")
def test_what_nohup_or_a_job_in_the_background_ignores_stays_ignored(number):
    signal.signal(number, signal.SIG_IGN)
    gate = InterruptGate()
    with one_ending():
        gate.open()
        signal.raise_signal(number)
        assert signal.getsignal(number) is signal.SIG_IGN
        gate.close()
    assert signal.getsignal(number) is signal.SIG_IGN


@pytest.mark.usefixtures("signals_of_a_terminal")
@pytest.mark.parametrize("session", ["closed", "left open"])
def test_a_process_that_ends_then_is_not_killed_by_a_late_signal(session):
    before = {each: signal.getsignal(each) for each in CODES}
    gate = InterruptGate()
    try:
        with one_ending(last=True):
            gate.open()
            if session == "closed":
                gate.close()
        ignored = [signal.getsignal(each) for each in CODES]
        assert ignored == [signal.SIG_IGN] * len(CODES)
        for each in CODES:
            signal.raise_signal(each)
    finally:
        gate.close()
        for each, handler in before.items():
            signal.signal(each, handler)


@pytest.mark.usefixtures("signals_of_a_terminal")
@pytest.mark.parametrize("buffered", [True, False])
def test_a_write_that_nobody_reads_ends_the_command_once(monkeypatch, buffered):
    reader, writer = os.pipe()
    os.close(reader)
    raw = io.FileIO(writer, "wb")
    stream = io.TextIOWrapper(io.BufferedWriter(raw) if buffered else raw, write_through=True)
    monkeypatch.setattr(sys, "stdout", stream)
    with one_ending(), watched_output():
        with pytest.raises(Interrupted) as raised:
            print("lost", flush=True)  # noqa: T201 - the stream is what is tested
        assert raised.value.by is EndedBy.OUTPUT_CLOSED
        print("the sentences of the cleaning up", flush=True)  # noqa: T201
    assert sys.stdout is stream
    stream.close()


@pytest.mark.usefixtures("signals_of_a_terminal")
def test_output_that_was_closed_from_the_start_goes_nowhere(monkeypatch):
    monkeypatch.setattr(sys, "stderr", None)
    with watched_output():
        print("to nobody", file=sys.stderr)  # noqa: T201
    assert sys.stderr is None
    with pytest.raises(OSError, match="the disk"), watched_output():
        raise OSError("the disk")
    assert sys.stderr is None


@pytest.fixture
def ended(command, simulator, capsys):
    """Run a command that does ``act`` on the controller."""

    def run(act, *more):
        def at_work(context):
            with open_controller(context) as controller:
                act(controller)

        command(at_work)
        code = main.run(["-c", simulator.url, "status", *more])
        shown = capsys.readouterr()
        return code, shown.out, shown.err

    return run


@pytest.mark.usefixtures("signals_of_a_terminal")
def test_the_last_line_says_what_stands_what_was_written_and_what_is_selected(ended, number):
    code, out, err = ended(lambda _controller: signal.raise_signal(number))
    assert (code, out) == (CODES[number], "")
    assert err.splitlines()[-1] == "  Nothing moved. Nothing was written. Tool 1 is selected."


@pytest.mark.usefixtures("signals_of_a_terminal")
def test_a_tool_that_was_written_before_is_named(ended):
    def act(controller):
        change_tools(controller, [Wanted(3, NEW_BY_END, controller.tools.read(3))])
        signal.raise_signal(signal.SIGTERM)

    code, _, err = ended(act)
    assert code == 143
    assert err.splitlines()[-1] == (
        "  Nothing moved. Tool 3 now holds X 1.500 Y 2.500 Z 3.500 U 0.000; before, it held "
        "undefined. Tool 1 is selected."
    )


@pytest.mark.usefixtures("signals_of_a_terminal")
def test_what_nobody_is_left_to_read_is_on_record(ended):
    def act(controller):
        change_tools(controller, [Wanted(3, NEW_BY_END, controller.tools.read(3))])
        signal.raise_signal(signal.SIGHUP)

    code, _, err = ended(act)
    assert code == 129
    found = []
    ended(lambda controller: found.extend(controller.outcomes.recorded(kinds=[EntryKind.DECISION])))
    assert found[0].verdict == err.splitlines()[-1].strip()
    assert found[0].details == {"ended_by": "SIGHUP"}


@pytest.mark.usefixtures("signals_of_a_terminal")
def test_a_tool_that_was_put_back_is_named(ended, simulator):
    before = simulator.machine.tools.get(1)

    def act(controller):
        wanted = [Wanted(1, NEW_BY_END, controller.tools.read(1))]
        with ToolChange(controller, wanted, verify=True) as change:
            change.write()
            signal.raise_signal(signal.SIGHUP)

    code, out, err = ended(act, "--json")
    assert code == 129
    assert err.splitlines()[-1].endswith(", as before. Tool 1 is selected.")
    document = json.loads(out)
    assert document["error"]["ended_by"] == "SIGHUP"
    assert document["error"]["controller_state"] == "unchanged"
    assert simulator.machine.tools.get(1) == before


@pytest.mark.usefixtures("signals_of_a_terminal")
def test_a_doubtful_outcome_keeps_its_exit_code_and_names_what_ended_it(ended):
    def act(_controller):
        try:
            signal.raise_signal(signal.SIGTERM)
        finally:
            raise OutcomeUnknownError("No end was seen.", remedy="Look at the robot.")

    code, out, _ = ended(act, "--json")
    document = json.loads(out)
    assert code == document["exit_code"] == 6
    assert document["error"]["ended_by"] == "SIGTERM"


@pytest.mark.usefixtures("signals_of_a_terminal")
def test_a_write_that_stays_unsettled_is_6_though_a_signal_ended_it(ended, simulator):
    def act(controller):
        wanted = [Wanted(1, NEW_BY_END, controller.tools.read(1))]
        with ToolChange(controller, wanted, verify=True) as change:
            change.write()
            simulator.panel.press_estop()
            signal.raise_signal(signal.SIGTERM)

    code, out, err = ended(act, "--json")
    assert code == 6
    assert json.loads(out)["error"]["ended_by"] == "SIGTERM"
    last = err.splitlines()[-1]
    assert last.endswith("Next: robolink robot reset, then robolink recover.")


@pytest.mark.usefixtures("signals_of_a_terminal")
def test_a_list_that_is_cut_off_by_its_reader_is_no_news_to_him(ended):
    def act(_controller):
        raise Interrupted(EndedBy.OUTPUT_CLOSED)

    assert ended(act) == (141, "", "")
