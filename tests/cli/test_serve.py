"""expert serve and orders: permitted callers, killed servers, and repeated deliveries."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
from contextlib import ExitStack

import pytest
from click.testing import CliRunner
from robolink_cli import main
from robolink_cli.commands.simulate import service
from robolink_cli.main import cli
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.hosting.in_process.softmotion import register, unregister
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.softmotion.mailbox.option_text import PlcOptions
from robolink_simulators.softmotion.mailbox.options import MailboxOptions
from robolink_simulators.testkit.program_calls import CallFault

from robolink import runtime
from robolink.errors import ConfigError, JournalError
from robolink.journal import memory_journal, open_journal
from robolink.model import EntryKind, ToolOffset, new_operation
from robolink.protocols.spel_callback import CallbackLine, CallbackWord, encode_line
from robolink.serving import CallbackConversation, CallbackLimits, CallbackServer
from robolink.serving._server import MOST_PROGRAMS
from tests._documents import wrong_in
from tests.contract._permit_machine import PermitMachine
from tests.faults._callback_cell import CallbackCell

# expert serve: as a process that is killed, and its permitted callers.

SERVED = ("--spel", "127.0.0.1:0", "--sigma-mm", "0.01", "--json")


def conversation(peer):
    return CallbackConversation(memory_journal(new_operation()), CallbackLimits(), peer=peer)


def started(stack):
    """Start the command as a process; return it and its address."""
    process = subprocess.Popen(
        [sys.executable, "-m", "robolink_cli", "serve", *SERVED],
        stdout=subprocess.PIPE,
        env=dict(os.environ),
    )
    stack.callback(process.wait, 30)
    stack.callback(process.kill)
    assert process.stdout is not None
    stack.callback(process.stdout.close)
    document = json.loads(process.stdout.readline())
    assert document["schema"] == "robolink/serve/1"
    assert wrong_in(document) == []
    return process, (document["host"], document["port"])


def test_a_server_that_is_killed_in_the_proof_leaves_the_old_tool_and_the_next_one_settles(
    tmp_path,
):
    cell = CallbackCell(tmp_path)
    with ExitStack() as stack:
        stack.callback(cell.close)
        process, cell.address = started(stack)
        cell.change_needle()
        old = cell.tool

        def bend(at, _line):
            if at == 9:
                process.kill()
                process.wait(30)
                return CallFault(cut_before=True)
            return None

        cell.calls.fault = bend
        cell.run()
        assert cell.tool.rounded(3) == old.rounded(3)
        journal = open_journal()
        assert [marker.details["verify"] for _, marker in journal.open_markers()] == [True]
        _, cell.address = started(stack)
        assert cell.run() == ["kept"]
        assert cell.error_mm < 0.02
        assert journal.open_markers() == ()
        kinds = [entry.kind for entry in journal.entries(newest_first=False)]
        assert kinds.index(EntryKind.ROLLED_BACK) < kinds.index(EntryKind.DONE)


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.0.20"])
def test_another_address_than_this_computer_s_needs_a_list_of_who_may_call(host):
    with pytest.raises(ConfigError, match="any computer on the network"):
        CallbackServer(host, 0, conversation)


def test_who_is_not_on_the_list_is_cut_off_unheard():
    told: list[str] = []
    server = CallbackServer("127.0.0.1", 0, conversation, allow=["192.168.0.1"], tell=told.append)
    server.start()
    try:
        with socket.create_connection(server.address, timeout=10) as link:
            assert link.recv(1) == b""
    finally:
        server.close()
    assert told == ["127.0.0.1 may not connect; robolink disconnected it."]


@pytest.fixture
def listening():
    """Start a server; return it and its output."""
    servers = []

    def started(conversation=conversation):
        told: list[str] = []
        server = CallbackServer("127.0.0.1", 0, conversation, tell=told.append)
        servers.append(server)
        return server, told

    yield started
    for server in servers:
        server.close()


HELLO = encode_line(CallbackLine(1, CallbackWord.HELLO, ("S", "1", "0", "-", "1", "1", *["0"] * 6)))


def greeted(link):
    """Return whether the server answers a program."""
    link.sendall(HELLO)
    return b"WELCOME" in link.recv(200)


def test_who_finds_no_room_is_told_so_and_not_that_it_may_not_call(listening):
    server, told = listening()
    server.start()
    with ExitStack() as stack:
        *_, last, ninth = (
            stack.enter_context(socket.create_connection(server.address, timeout=10))
            for _ in range(MOST_PROGRAMS + 1)
        )
        assert greeted(last)
        assert ninth.recv(1) == b""
        assert told == [
            ("robolink disconnected 127.0.0.1: 8 programs are connected already, the most allowed.")
        ]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("error", [JournalError("no journal"), OSError(28, "full"), KeyError(1)])
def test_programs_that_cannot_be_answered_take_no_place_away(listening, error):
    refused: list[str] = []

    def first_fail(peer):
        if len(refused) < MOST_PROGRAMS:
            refused.append(peer)
            raise error
        return conversation(peer)

    server, told = listening(first_fail)
    server.start()
    for _ in range(MOST_PROGRAMS):
        with socket.create_connection(server.address, timeout=10) as link:
            assert link.recv(1) == b""
    with socket.create_connection(server.address, timeout=10) as link:
        assert greeted(link)
    expected = "robolink disconnected 127.0.0.1: no journal"
    assert told == ([expected] * MOST_PROGRAMS if isinstance(error, JournalError) else [])


class Failing:
    """A listener that at first cannot accept connections."""

    def __init__(self, listener, errors):
        self._listener, self._errors = listener, errors

    def accept(self):
        if self._errors:
            raise self._errors.pop()
        return self._listener.accept()

    def close(self):
        self._listener.close()


def test_an_error_of_the_system_does_not_end_the_listening(listening, monkeypatch):
    waits: list[float] = []
    monkeypatch.setattr(runtime, "sleep", waits.append)
    server, told = listening()
    errors = [OSError(103, "aborted"), OSError(24, "too many files"), OSError(24, "too many files")]
    monkeypatch.setattr(server, "_listener", Failing(server._listener, errors))
    server.start()
    with socket.create_connection(server.address, timeout=10) as link:
        assert greeted(link)
    assert waits == [1.0, 1.0, 1.0]
    # The same fault is reported once.
    assert told == [
        "No program can connect now: too many files. robolink tries again every second.",
        "No program can connect now: aborted. robolink tries again every second.",
    ]


def test_a_system_without_a_further_thread_does_not_end_the_listening(listening, monkeypatch):
    server, told = listening()
    server.start()
    begin, refused = threading.Thread.start, iter([True] * (MOST_PROGRAMS + 1))

    def start(thread):
        if next(refused, False):
            raise RuntimeError("can't start new thread")
        begin(thread)

    monkeypatch.setattr(threading.Thread, "start", start)
    # As often as there are places: each of them becomes free again.
    for _ in range(MOST_PROGRAMS + 1):
        with socket.create_connection(server.address, timeout=10) as link:
            assert link.recv(1) == b""
    with socket.create_connection(server.address, timeout=10) as link:
        assert greeted(link)
    assert told == ["robolink disconnected 127.0.0.1: can't start new thread"] * (MOST_PROGRAMS + 1)


def test_an_address_that_is_taken_is_told_once():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(ConfigError) as told:
            CallbackServer("127.0.0.1", port, conversation)
    assert "(" not in told.value.what
    assert told.value.what.count("127.0.0.1") == 1


def test_a_console_that_fails_does_not_end_the_listening(monkeypatch):
    monkeypatch.setattr(runtime, "sleep", lambda _seconds: None)

    def tell(_sentence):
        raise BrokenPipeError

    server = CallbackServer("127.0.0.1", 0, conversation, tell=tell)
    errors = [OSError(24, "too many files")]
    monkeypatch.setattr(server, "_listener", Failing(server._listener, errors))
    server.start()
    try:
        with socket.create_connection(server.address, timeout=10) as link:
            assert greeted(link)
    finally:
        server.close()


def test_an_address_that_is_taken_is_refused_with_what_to_do(listening):
    server, _ = listening()
    with pytest.raises(ConfigError, match="Address already in use") as caught:
        CallbackServer("127.0.0.1", server.address[1], conversation)
    assert "Errno" not in caught.value.what
    assert caught.value.remedy == "Give an address of this computer and another port; 0 is any."


@pytest.mark.parametrize(
    "sent",
    [
        b"GET / HTTP/1.1\r\n\r\n",
        b"x" * 4000,
        encode_line(CallbackLine(1, CallbackWord.BEGIN)),
        encode_line(CallbackLine(1, CallbackWord.WELCOME)),
        encode_line(CallbackLine(2, CallbackWord.HELLO, ("S", *["0"] * 11))),
        encode_line(CallbackLine(1, CallbackWord.HELLO, ("S", "1", "9", *["0"] * 9))),
    ],
)
def test_what_is_no_question_here_is_cut_off_without_an_answer(sent):
    told: list[str] = []
    server = CallbackServer("127.0.0.1", 0, conversation, tell=told.append)
    server.start()
    try:
        with socket.create_connection(server.address, timeout=10) as link:
            link.sendall(sent)
            assert link.recv(100) == b""
    except ConnectionResetError:
        pass
    finally:
        server.close()
    assert len(told) == 1


class DamagedJournal:
    """A damaged journal that cannot be used."""

    def log(self, _controller, **_given):
        """Refuse."""
        raise JournalError("The journal is damaged.", remedy="Move the file away.")


class OneProgram:
    """A server with one calling program, which has its own thread."""

    def __init__(self, host, port, conversation, **_given):
        self.address, self._conversation = (host, port), conversation

    def start(self):
        """Let it call and identify itself."""
        line = CallbackLine(1, CallbackWord.HELLO, ("S", "1", "0", "-", "1", "1", *["0"] * 6))
        calls = threading.Thread(target=lambda: self._conversation("10.0.0.7").answer(line))
        calls.start()
        calls.join(30)

    def close(self):
        """End the call."""


@pytest.mark.parametrize("as_json", [False, True])
def test_whoever_watches_reads_why_a_program_was_refused_and_what_to_do(monkeypatch, as_json):
    monkeypatch.setattr("robolink.serving.CallbackServer", OneProgram)
    monkeypatch.setattr("robolink.journal.open_journal", DamagedJournal)
    monkeypatch.setattr(service.Termination, "wait", lambda _termination: None)
    line = ["expert", "serve", "--spel", "127.0.0.1:5001", *(["--json"] if as_json else [])]
    result = CliRunner().invoke(cli, line)
    assert result.exit_code == 0, result.output
    sentence = "10.0.0.7 gets the answer journal: The journal is damaged. Move the file away."
    assert sentence in " ".join(result.stderr.split())
    if as_json:
        event, _ = map(json.loads, result.stdout.splitlines())
        assert event == {
            "schema": "robolink/serve-event/1",
            "event": "refused",
            "code": "journal",
            "what": "The journal is damaged.",
            "remedy": "Move the file away.",
            "peer": "10.0.0.7",
        }


# expert serve --plc: the program of a PLC calls, and the machine goes on with a tested tool.

SERVED_PLC = ("serve", "--plc", "n-angle", "--tool", "1", "--sigma-mm", "0.01", "--json")


class MachineClock(ManualClock):
    """A clock whose waits advance the machine; it produces before each call."""

    parts = 12

    def __init__(self, simulator):
        super().__init__()
        self.machine = PermitMachine(simulator)
        self.calls: list[str] = []
        self.produced = 0

    def sleep(self, seconds):
        super().sleep(seconds)
        self.produced += 1
        if self.produced < self.parts:
            return
        self.machine.look()
        if self.machine.state in ("produces", "gave up"):
            self.calls.append(self.machine.state)
            self.machine.bump_mm = 0.0
            self.machine.begin()
            self.produced = 0
            if len(self.calls) == 2:
                os.kill(os.getpid(), signal.SIGTERM)


def test_calls_are_answered_one_after_the_other_until_somebody_ends_it(capsys):
    options = PlcOptions(mailbox=MailboxOptions(profile="tools"))
    simulator = SoftMotionSimulator(seed=7, options=options)
    clock = MachineClock(simulator)
    url = register("serve-plc", simulator, clock=clock)
    clock.machine.bump_mm = 0.15
    try:
        assert main.run(["-c", url, *SERVED_PLC, "--permit-is-contact"]) == 0
    finally:
        unregister("serve-plc")
    told = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [one["event"] for one in told] == ["listening", "refused", "kept"]
    assert clock.calls == ["produces"] * 2
    assert told[1]["code"] == "point_moved"
    assert told[2]["tool"] == 1
    assert clock.machine.error_mm < 0.02
    assert not clock.machine.panel.tool_changed


@pytest.mark.parametrize(
    "words",
    [
        ("serve",),
        ("serve", "--plc", "n-angle", "--spel", "127.0.0.1:0"),
        SERVED_PLC,
        ("serve", "--plc", "n-angle", "--permit-is-contact"),
        (*SERVED_PLC, "--permit-is-contact", "--touches", "3"),
    ],
    ids=["neither", "both", "no-witness", "no-tool", "few-touches"],
)
def test_what_would_prove_nothing_is_refused_before_the_plc_is_asked(words):
    assert main.run(["-c", "softmotion+modbus-tcp://127.0.0.1:1", *words]) == 2


def test_a_controller_without_a_mailbox_is_refused():
    words = [*SERVED_PLC, "--permit-is-contact"]
    assert main.run(["-c", "epson+sim://no-mailbox", *words]) == 2


# --order: repeated deliveries, and their refusals.

SET = ("tool", "set", "1", "--x", "12.5", "--order", "A-17", "--yes")
NEW = ToolOffset(12.5, -3.5, -20.0)


@pytest.mark.fault("F79")
def test_f79_an_order_delivered_again_reports_the_first_result_and_writes_nothing(run, simulator):
    code, out, err = run(*SET, "--json")
    assert code == 0, err
    first = json.loads(out)
    assert (first["order"], first["already_done"]) == ("A-17", False)
    written, entries = simulator.machine.flash_writes, open_journal().count()
    code, out, _ = run(*SET, "--json")
    assert (code, json.loads(out)) == (0, {**first, "already_done": True})
    assert first["read_back"]["x_mm"] == 12.5
    assert "Nothing was moved or written now" in run(*SET)[1]
    assert (simulator.machine.flash_writes, open_journal().count()) == (written, entries)


@pytest.mark.fault("F79")
@pytest.mark.parametrize(
    ("between", "code", "said"),
    [
        (("undo", "--yes"), 2, "Order A-17 was undone"),
        (("tool", "set", "1", "--x", "13", "--yes"), 5, "it holds X 13.000"),
    ],
)
def test_f79_an_order_that_does_not_stand_any_more_is_refused_by_name(
    run, simulator, between, code, said
):
    assert run(*SET)[0] == 0
    assert run(*between)[0] == 0
    held, written = simulator.machine.tools.get(1), simulator.machine.flash_writes
    refused, _, err = run(*SET)
    assert refused == code
    assert said in " ".join(err.split())
    assert "Give a new order" in " ".join(err.split())
    assert (simulator.machine.tools.get(1), simulator.machine.flash_writes) == (held, written)
    assert run("tool", "set", "1", "--x", "12.5", "--order", "A-18", "--yes")[0] == 0
    assert simulator.machine.tools.get(1) == NEW


@pytest.mark.fault("F79")
def test_f79_one_order_for_two_jobs_is_refused(run, simulator):
    assert run(*SET)[0] == 0
    code, _, err = run("tool", "set", "1", "--x", "12.6", "--order", "A-17", "--yes")
    assert (code, "for another job" in err) == (2, True)
    assert simulator.machine.tools.get(1) == NEW


@pytest.mark.fault("F79")
@pytest.mark.parametrize("order", ["", "x" * 65, "Zw\xf6lf", "a\nb"])
def test_f79_an_order_is_some_printable_characters(run, simulator, order):
    code, _, err = run("tool", "set", "1", "--x", "12.5", "--order", order, "--yes")
    assert (code, "not the id of an order" in err) == (2, True)
    assert simulator.machine.flash_writes == 0


@pytest.mark.fault("F79")
def test_f79_a_dry_run_carries_out_no_order(run, simulator):
    for words in ((*SET[:-1],), ("calibrate", "two-pose", "--tool", "1", "--order", "A-17")):
        code, _, err = run(*words, "--dry-run")
        assert (code, "A dry run carries out no order" in err) == (2, True)
    assert not list(open_journal().entries(kinds=(EntryKind.ORDER,)))
