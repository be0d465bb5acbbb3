"""Nearly valid answers of an OPC UA server: each is taken, or refused by an error of ours."""

from functools import cache

from hypothesis import strategies as st

from robolink.errors import ConnectError, RejectedError, RemoteProtocolError, TransportError
from tests.fuzz._mutating import edited_bytes, fuzzed
from tests.unit._scripted_opcua import NODE, VALUES, ScriptedTransport, connected, dialogue

ANSWERS = 7
HEADER = 8


@cache
def answers() -> tuple[bytes, ...]:
    return tuple(dialogue())


def resized(data: bytes) -> bytes:
    """Return a message whose head says how long it has become."""
    return data[:4] + len(data).to_bytes(4, "little") + data[8:]


@st.composite
def bent(draw: st.DrawFn) -> tuple[int, bytes]:
    """Return the number of an answer, and nearly its bytes, of a length that its head tells."""
    number = draw(st.integers(0, ANSWERS - 1))
    whole = answers()[number]
    data = whole[:HEADER] + draw(edited_bytes(whole[HEADER:]))
    return number, resized(data) if draw(st.booleans()) else data


def outcome(transport: ScriptedTransport) -> str:
    """Carry out the dialogue; return how it ended."""
    try:
        client = connected(transport)
        (read,) = client.read([NODE])
        client.write(NODE, VALUES)
    except (RemoteProtocolError, RejectedError, TransportError, ConnectError) as error:
        return type(error).__name__
    assert len(read) == len(VALUES)
    assert all(isinstance(one, float) for one in read)
    return "done"


def test_the_dialogue_is_right():
    """Otherwise the test below would only test refusals."""
    transport = ScriptedTransport(list(answers()))
    assert outcome(transport) == "done"
    assert len(transport.sent) == ANSWERS


@fuzzed(8, 5_000, case=bent())
def test_whatever_a_server_answers_is_taken_or_refused_and_nothing_is_sent_twice(case):
    number, data = case
    transport = ScriptedTransport(
        list(answers()), lambda at, right: data if at == number else right
    )
    ended = outcome(transport)
    assert ended == "done" or len(transport.sent) <= ANSWERS
    assert len(transport.sent) == len(set(transport.sent))
