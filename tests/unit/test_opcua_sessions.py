"""A session with a server that grants little, refuses, or leaves open what it did."""

import time
from typing import Any

import pytest

from robolink.errors import (
    ConfigError,
    ConnectError,
    LoginRefusedError,
    RejectedError,
    RemoteProtocolError,
    TransportBrokenError,
    TransportClosedError,
    TransportTimeoutError,
)
from tests._rows import each_row
from tests.unit._scripted_opcua import (
    NODE,
    VALUES,
    ScriptedTransport,
    aborted,
    answered,
    connected,
    dialogue,
    fault,
    told_error,
)

HELLO, CHANNEL, SESSION, LOGIN, DESCRIPTION, READ, WRITE = range(7)


def scripted(instead: dict[int, bytes], **granted: Any) -> ScriptedTransport:
    answers = dialogue(**granted)
    return ScriptedTransport([instead.get(at, one) for at, one in enumerate(answers)])


def named(value: object) -> str | None:
    """Return the name of an answer in the name of its test: its bytes hold the time."""
    return "answer" if isinstance(value, bytes) else None


@each_row(
    ("at", "answer", "expected", "words"),
    [
        (HELLO, told_error("BadTcpServerTooBusy"), ConnectError, "takes no more clients"),
        (HELLO, told_error("BadTcpEndpointUrlInvalid"), RejectedError, "BadTcpEndpointUrlInvalid"),
        (SESSION, fault(2, "BadTooManySessions"), ConnectError, "takes no more clients"),
        (LOGIN, fault(3, "BadIdentityTokenRejected"), LoginRefusedError, "without a name"),
        (LOGIN, fault(3, "BadSecurityChecksFailed"), RejectedError, "BadSecurityChecksFailed"),
        (LOGIN, b"", ConnectError, "nobody opens a session"),
    ],
)
def test_a_server_that_opens_no_session_says_why(at, answer, expected, words):
    transport = scripted({at: answer})
    with pytest.raises(expected, match=words) as caught:
        connected(transport)
    assert type(caught.value) is expected
    assert transport.closed
    assert len(transport.sent) == at + 1


@each_row(
    ("answer", "expected", "stays"),
    [
        (fault(6, "BadUserAccessDenied"), RejectedError, True),
        (fault(6, "BadTooManyOperations"), RejectedError, True),
        (fault(6, "BadInternalError"), RemoteProtocolError, False),
        (fault(6, "BadTimeout"), TransportTimeoutError, False),
        (fault(6, "BadSessionIdInvalid"), TransportBrokenError, False),
        (aborted(6), RemoteProtocolError, False),
        (told_error("BadTcpInternalError"), TransportBrokenError, False),
        (told_error("BadNotWritable"), TransportBrokenError, False),
        (b"", TransportTimeoutError, False),
    ],
)
def test_only_a_refusal_says_that_a_write_was_not_done(answer, expected, stays):
    transport = scripted({WRITE: answer})
    client = connected(transport)
    client.read([NODE])
    with pytest.raises(expected) as caught:
        client.write(NODE, VALUES)
    assert type(caught.value) is expected
    assert transport.closed is not stays
    assert len(transport.sent) == WRITE + 1


@each_row(
    ("came", "expected", "words"),
    [
        (told_error("BadNotWritable"), TransportBrokenError, "BadNotWritable"),
        (dialogue()[WRITE], RemoteProtocolError, "MSG"),
    ],
)
@each_row("at_once", [False, True])
def test_what_came_while_idle_is_noticed_before_anything_is_sent(came, expected, words, at_once):
    """At once: in one piece with the answer before it."""
    right = dialogue()[READ]
    transport = scripted({READ: right + came if at_once else right})
    client = connected(transport)
    client.read([NODE])
    if not at_once:
        transport.waiting = came
    with pytest.raises(expected, match=words):
        client.write(NODE, VALUES)
    assert len(transport.sent) == READ + 1


def test_the_rest_of_a_list_that_is_none_makes_no_sense():
    from asyncua import ua

    part = ua.BrowseResponse(Results=[ua.BrowseResult(ContinuationPoint=b"more")])
    rest = ua.BrowseNextResponse()
    transport = scripted({DESCRIPTION: answered(4, part), READ: answered(5, rest)})
    client = connected(transport)
    with pytest.raises(RemoteProtocolError, match="below"):
        client.browse()
    assert transport.closed


@pytest.mark.parametrize(
    ("status", "expected"),
    [("BadTypeMismatch", RejectedError), ("BadUnexpectedError", RemoteProtocolError)],
)
def test_the_status_of_the_node_counts(status, expected):
    transport = scripted({}, status=status)
    client = connected(transport)
    client.read([NODE])
    with pytest.raises(expected, match=status):
        client.write(NODE, VALUES)


@each_row("session_ms", [0.0, float("nan"), float("inf"), 86_400_000.0])
def test_a_server_that_grants_any_time_is_held_to_ours(session_ms):
    transport = scripted({}, session_ms=session_ms, lifetime_ms=0)
    client = connected(transport)
    transport.clock.sleep(299)
    assert client.read([NODE]) == (VALUES,)
    transport.clock.sleep(301)
    with pytest.raises(TransportBrokenError, match="301 s"):
        client.write(NODE, VALUES)
    assert len(transport.sent) == READ + 1
    with pytest.raises(TransportClosedError):
        client.read([NODE])


def test_a_shorter_time_is_kept():
    transport = scripted({}, session_ms=10_000.0)
    client = connected(transport)
    transport.clock.sleep(11)
    with pytest.raises(TransportBrokenError, match="11 s"):
        client.read([NODE])
    assert len(transport.sent) == LOGIN + 1


def test_a_number_that_no_double_holds_is_not_sent():
    transport = scripted({})
    client = connected(transport)
    client.read([NODE])
    with pytest.raises(ConfigError, match="does not fit"):
        client.write(NODE, [10**400] * 6)
    assert len(transport.sent) == READ + 1
    client.write(NODE, VALUES)
    assert len(transport.sent) == WRITE + 1


@each_row("kind", [b"\x80", b"\xc0"])
@each_row("count", [b"\xff\xff\xff\x7f", b"\xfe\xff\xff\xff"])
def test_an_array_of_two_thousand_million_nulls_is_not_taken_apart(kind, count):
    array = b"\x8b\x06\x00\x00\x00"
    right = dialogue()[READ]
    assert right.count(array) == 1
    transport = scripted({READ: right.replace(array, kind + count)})
    client = connected(transport)
    began = time.process_time()
    with pytest.raises(RemoteProtocolError):
        client.read([NODE])
    assert time.process_time() - began < 1
