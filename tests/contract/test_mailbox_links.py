"""The contract of a mailbox link, on real servers, a serial cable and a CANopen node."""

import threading
from contextlib import ExitStack, closing
from functools import partial

import pytest

from robolink.errors import (
    RejectedError,
    RemoteProtocolError,
    StoppedError,
    TransportClosedError,
)
from robolink.transport import MailboxHead, open_mailbox_link, open_modbus, told_to
from tests.contract._mailbox_far_ends import (
    NODE,
    CanopenFarEnd,
    ModbusFarEnd,
    modbus_rtu,
    modbus_tcp,
    multicast_node,
    virtual_node,
)
from tests.contract._opcua_far_end import OpcuaFarEnd, opcua_server

COMMAND = tuple(range(1000, 1064))
RESPONSE = tuple(range(100, 212))
SLOT = tuple(range(100, 136))


@pytest.fixture(scope="module")
def symbols():
    """A server for all tests here."""
    with opcua_server() as far_end:
        yield far_end


@pytest.fixture(params=["tcp", "rtu", "rtu-echo", "virtual", "multicast", "opcua"])
def far_end(request, tmp_path):
    with ExitStack() as stack:
        if request.param == "opcua":
            end = request.getfixturevalue("symbols")
            end.reset()
            yield end
        elif request.param == "tcp":
            yield stack.enter_context(modbus_tcp())
        elif request.param.startswith("rtu"):
            echo = request.param == "rtu-echo"
            end, _ = stack.enter_context(modbus_rtu(echo=echo))
            end.url += "&echo=yes" if echo else ""
            yield end
        elif request.param == "virtual":
            yield stack.enter_context(virtual_node(tmp_path.name))
        else:
            yield stack.enter_context(multicast_node())


@pytest.fixture
def link(far_end):
    with closing(open_mailbox_link(far_end.url, timeout_s=2.0)) as opened:
        yield opened


def test_a_command_arrives_whole(far_end, link):
    link.write_command(COMMAND)
    assert far_end.command() == list(COMMAND)
    link.write_command(COMMAND[::-1])
    assert far_end.command() == list(COMMAND[::-1])


def test_a_response_is_read_whole(far_end, link):
    far_end.put_response(RESPONSE)
    assert link.read_response() == RESPONSE
    far_end.put_response(RESPONSE[::-1])
    assert link.read_response() == RESPONSE[::-1]


def test_all_that_passes_is_told_to_a_trace(far_end):
    told = []
    with told_to(lambda _ns, direction, data: told.append((direction, data))):
        link = open_mailbox_link(far_end.url, timeout_s=2.0)
    with closing(link):
        link.write_command(COMMAND)
        far_end.put_response(RESPONSE)
        link.read_response()
        sent = b"".join(data for direction, data in told if direction == "sent")
        received = b"".join(data for direction, data in told if direction == "received")
        # CANopen and OPC UA send a word low byte first, and a frame of CAN holds seven bytes.
        low_first = isinstance(far_end, CanopenFarEnd | OpcuaFarEnd)
        assert (b"\xe8\x03\xe9" if low_first else b"\x03\xe8\x03") in sent
        assert (b"\x64\x00\x65" if low_first else b"\x00\x64\x00") in received
        link.close()
        count = len(told)
        with closing(link.reopened(timeout_s=2.0)) as again:
            again.read_response()
        assert len(told) > count, "one that is opened again tells it too"


def test_a_head_is_the_beginning_of_the_response(far_end, link):
    words = (256, 7, 10, 0, 0, 0, 0, 1, 0, 4711, *RESPONSE[10:])
    far_end.put_response(words)
    assert link.read_head() == MailboxHead(
        ack=7, state=10, error_class=0, group_state=1, heartbeat=4711
    )


def test_every_slot_has_its_place(far_end, link):
    for slot in (1, 2, 15):
        far_end.put_slot(slot, tuple(word + slot for word in SLOT))
    for slot in (15, 1, 2):
        assert link.read_slot(slot) == tuple(word + slot for word in SLOT)


def test_the_number_of_the_plc_is_the_same_four_words_on_every_link(far_end, link):
    far_end.put_device(0xBEEF, 0x1234)
    assert link.read_device() == (0xBEEF, 0x1234, 0x4110, 0xEDCB)


@pytest.mark.parametrize("slots", [1460, 0x10000 - 15 * 36])
def test_registers_without_that_number_are_a_refusal_and_the_link_goes_on(slots):
    with modbus_tcp() as far_end:
        with closing(open_mailbox_link(f"{far_end.url}&slots={slots}")) as link:
            with pytest.raises(RejectedError):
                link.read_device()
            assert link.read_head().ack == 0


def test_a_beat_is_the_heartbeat_word_alone(far_end, link):
    if isinstance(far_end, ModbusFarEnd):
        link.write_command(COMMAND)
    link.beat(0x0102)
    assert far_end.heartbeat() == 0x0102
    if isinstance(far_end, ModbusFarEnd):
        assert far_end.command() == [*COMMAND[:62], 0x0102, COMMAND[63]]
    elif isinstance(far_end, OpcuaFarEnd):
        assert far_end.command() == [0] * 64, "the array of the command is left alone"


@pytest.mark.fault("F32", "F35")
@pytest.mark.parametrize("serial", [False, True], ids=["tcp", "rtu"])
def test_f35_each_exchange_over_modbus_is_one_request_for_registers(serial):
    with ExitStack() as stack:
        far_end = (
            stack.enter_context(modbus_rtu())[0] if serial else stack.enter_context(modbus_tcp())
        )
        link = stack.enter_context(closing(open_mailbox_link(far_end.url)))
        far_end.requests.clear()
        link.write_command(COMMAND)
        link.beat(1)
        link.read_head()
        link.read_response()
        link.read_slot(15)
        link.read_device()
    assert far_end.requests == [
        (16, 0, 64),
        (16, 62, 1),
        (4, 0, 10),
        (4, 0, 112),
        (4, 112 + 14 * 36, 36),
        (4, 652, 4),
    ]


@pytest.mark.fault("F32", "F35")
def test_f35_each_exchange_over_opc_ua_is_one_request_for_a_whole_variable(symbols):
    """A command is two: its heartbeat, which has to be there first, and its array."""
    symbols.reset()
    with closing(open_mailbox_link(symbols.url)) as link:
        symbols.requests.clear()
        link.write_command(COMMAND)
        link.beat(1)
        link.read_head()
        link.read_response()
        link.read_slot(15)
        link.read_device()
    assert symbols.requests == [
        ("write", "heartbeat"),
        ("write", "command"),
        ("write", "heartbeat"),
        ("read", "response"),
        ("read", "response"),
        ("read", "slots"),
        ("read", "slots"),
    ]


@pytest.mark.parametrize(
    ("name", "value", "kind"),
    [
        ("response", [1] * 111, "UInt16"),
        ("response", [1] * 113, "UInt16"),
        ("response", [1] * 112, "Int16"),
        ("response", 1, "UInt16"),
        ("slots", [1] * 543, "UInt16"),
    ],
    ids=["short", "long", "signed", "scalar", "slots"],
)
def test_a_variable_that_becomes_something_else_is_told_and_never_half_believed(
    symbols, name, value, kind
):
    symbols.reset()
    with closing(open_mailbox_link(symbols.url)) as link:
        link.read_response()
        symbols.put(name, value, kind)
        read = link.read_response if name == "response" else lambda: link.read_slot(15)
        with pytest.raises(RemoteProtocolError, match=name):
            read()


@pytest.mark.fault("F49")
def test_threads_never_get_each_others_answers(far_end, link):
    far_end.put_response(RESPONSE)
    far_end.put_slot(3, SLOT)
    wrong: list[tuple[int, ...]] = []

    def ask(read, due):
        wrong.extend(found for found in (read() for _ in range(5)) if found != due)

    threads = [
        threading.Thread(target=ask, args=(link.read_response, RESPONSE)),
        threading.Thread(target=ask, args=(lambda: link.read_slot(3), SLOT)),
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(20)
    assert wrong == []


def test_what_is_not_admitted_is_not_written_and_the_link_goes_on(far_end, link):
    link.write_command(COMMAND)
    before = far_end.command()

    def stopped():
        raise StoppedError("stopped", remedy="")

    for objection in (stopped, partial(next, iter(()))):
        with pytest.raises((StoppedError, StopIteration)):
            link.write_command(tuple(word + 1 for word in COMMAND), objection)
    assert far_end.command() == before
    far_end.put_response(RESPONSE)
    assert link.read_response() == RESPONSE
    link.write_command(tuple(word + 2 for word in COMMAND))
    assert far_end.command()[:62] == [word + 2 for word in COMMAND[:62]]


def test_a_write_is_admitted_when_no_other_exchange_is_under_way(far_end):
    """Between the last question and the wire nothing fits: not another exchange, nor a stop."""
    asked = threading.Event()
    writers: list[threading.Thread] = []

    def traffic(_now_ns, _way, _data):
        if writers:
            begun.append(writers.pop())
            begun[0].start()
            early.append(asked.wait(0.2))

    begun: list[threading.Thread] = []
    early: list[bool] = []
    far_end.put_response(RESPONSE)
    with told_to(traffic), closing(open_mailbox_link(far_end.url, timeout_s=2.0)) as link:
        write = partial(link.write_command, COMMAND, asked.set)
        writers.append(threading.Thread(target=write))
        link.read_response()
        begun[0].join(20)
    assert early == [False]
    assert asked.is_set()


def test_a_closed_link_says_so(link):
    link.close()
    link.close()
    with pytest.raises(TransportClosedError):
        link.read_response()
    with pytest.raises(TransportClosedError):
        link.write_command(COMMAND)


def test_what_names_the_far_end_is_its_identity(far_end, link):
    scheme_and_place, _, options = far_end.url.partition("?")
    assert link.identity.startswith(scheme_and_place)
    if isinstance(far_end, CanopenFarEnd):
        assert link.identity == f"{scheme_and_place}?node={NODE}"
    assert link.durable is ("virtual" not in options)


def test_a_response_may_stand_in_holding_registers():
    with modbus_tcp() as far_end:
        url = f"{far_end.url}&registers=holding&response=1000&slots=1200"
        with closing(open_mailbox_link(url)) as link:
            far_end.put_response(RESPONSE)
            assert link.read_response() == RESPONSE
            assert far_end.requests[-1] == (3, 1000, 112)


def test_a_second_mailbox_of_a_unit_is_another_far_end():
    with modbus_tcp() as far_end:
        with closing(open_mailbox_link(f"{far_end.url}&command=200&response=700")) as link:
            link.write_command(COMMAND)
            assert far_end.requests[-1] == (16, 200, 64)
            assert link.identity.endswith("?unit=1&command=200")


def test_a_usual_unit_and_port_are_not_part_of_the_name():
    with modbus_rtu() as (far_end, _):
        with closing(open_mailbox_link(far_end.url)) as link:
            assert link.identity == far_end.url.partition("?")[0]


def test_bare_registers_and_bits_are_read_and_written():
    with modbus_tcp() as far_end:
        url = far_end.url.replace("softmotion", "plc")
        with closing(open_modbus(url)) as client:
            client.write_registers(10, [1, 65535])
            assert client.read_holding(9, 4) == (0, 1, 65535, 0)
            assert client.read_input(0, 2) == (0, 0)
            client.write_coil(3, True)
            assert client.read_coils(2, 3) == (False, True, False)
            assert client.read_discrete(0, 5) == (False,) * 5
            with pytest.raises(RejectedError, match=r"42001 \(address 2000\) of unit 1"):
                client.read_holding(2000, 1)
            assert client.read_holding(10, 1) == (1,)
