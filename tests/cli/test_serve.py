"""expert serve: as a process that is killed, and who may call."""

import json
import os
import socket
import subprocess
import sys
from contextlib import ExitStack

import pytest

from robolink.errors import ConfigError
from robolink.journal import memory_journal, open_journal
from robolink.model import EntryKind, new_operation
from robolink.protocols.spel_callback import CallbackLine, CallbackWord, encode_line
from robolink.serving import CallbackConversation, CallbackLimits, CallbackServer
from tests.faults._callback_cell import Bend, CallbackCell

SERVED = ("--spel", "127.0.0.1:0", "--sigma-mm", "0.01", "--json")


def conversation(peer):
    return CallbackConversation(memory_journal(new_operation()), CallbackLimits(), peer=peer)


def started(stack):
    """Start the command as a process; return it, and where it listens."""
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
    return process, (document["host"], document["port"])


def test_a_server_that_is_killed_in_the_proof_leaves_the_old_tool_and_the_next_one_settles(
    tmp_path,
):
    cell = CallbackCell(tmp_path)
    with ExitStack() as stack:
        stack.callback(cell.close)
        process, cell.relay.server = started(stack)
        cell.change_needle()
        old = cell.tool

        def bend(at, _line):
            if at == 9:
                process.kill()
                process.wait(30)
                return Bend(cut_before=True)
            return None

        cell.relay.bend = bend
        cell.run()
        assert cell.tool.rounded(3) == old.rounded(3)
        journal = open_journal()
        assert [marker.details["verify"] for _, marker in journal.open_markers()] == [True]
        _, cell.relay.server = started(stack)
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
    assert told == ["127.0.0.1 may not call and was cut off."]


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
