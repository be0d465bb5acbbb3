"""The OPC UA client and the mailbox on it, against a real server in another thread."""

import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

from robolink.errors import ConfigError, RejectedError, RemoteProtocolError
from robolink.protocols.mailbox import Command, Opcode, encode_command
from robolink.transport import open_mailbox_link, open_opcua, parse_url, told_to
from robolink.transport._mailbox_link import is_stop
from tests._rows import each_row
from tests.unit._opcua_far_end import FarEnd, symbol

if TYPE_CHECKING:
    from robolink.transport.opcua.client import OpcuaClient


@pytest.fixture
def client(opcua_served: FarEnd) -> "Iterator[OpcuaClient]":
    one = open_opcua(opcua_served.url("plc"))
    yield one
    one.close()


def test_the_blocks_of_a_mailbox_are_read_and_written_whole(opcua_served: FarEnd) -> None:
    opcua_served.put("slots", list(range(544)))  # other tests share the server
    link = open_mailbox_link(opcua_served.url())
    try:
        assert link.read_response() == tuple(range(112))
        assert link.read_slot(15) == tuple(range(14 * 36, 15 * 36))
        assert link.read_device() == (540, 541, 542, 543)
        link.write_command(range(64, 128))
        link.beat(4711)
        assert opcua_served.value("command") == list(range(64, 128))
        assert opcua_served.value("heartbeat") == 4711
    finally:
        link.close()


def test_a_node_is_named_by_its_id_or_by_its_way(client: "OpcuaClient") -> None:
    way = "/DeviceSet/PLC/Resources/Application/GlobalVars/RL_Symbols/tool"
    assert client.describe(way).id == symbol("tool")
    assert client.describe("/4:DeviceSet/*/*/*/*/*/real").kind == "Float"
    assert client.describe(symbol("tool")).type_name == "Double[24]"
    with pytest.raises(RejectedError, match="has no /DeviceSet/Other"):
        client.describe("/DeviceSet/Other")
    with pytest.raises(ConfigError, match="may be any of"):
        client.describe("/DeviceSet/PLC/Resources/Application/GlobalVars/RL_Symbols/*")
    with pytest.raises(RejectedError, match="BadNodeIdUnknown"):
        client.describe("ns=4;s=|var|none")


@each_row(
    "text",
    [
        "i=2253",
        "ns=4;i=17",
        "ns=2;s=a;b=c",
        "ns=2;g=09087e75-8e5e-499b-954f-f2a9603db28a",
        "ns=2;b=cm9ib2xpbms=",
    ],
)
def test_an_id_of_each_kind_is_read(text: str) -> None:
    from robolink.transport.opcua.address_space import node_id, spelled

    assert spelled(node_id(text)) == text


@pytest.mark.parametrize(
    "value", [[1.0] * 23, [1.0] * 25, 1.0, "text", [True] * 24, [[1.0] * 24], None]
)
def test_a_value_that_does_not_fit_its_node_is_not_sent(
    client: "OpcuaClient", opcua_served: FarEnd, value: object
) -> None:
    before = opcua_served.value("tool")
    with pytest.raises(ConfigError, match="does not fit"):
        client.write(symbol("tool"), value)
    assert opcua_served.value("tool") == before


@each_row(
    ("kind", "least", "most"),
    [
        ("SByte", -128, 127),
        ("Byte", 0, 255),
        ("Int16", -32768, 32767),
        ("UInt16", 0, 65535),
        ("Int32", -2147483648, 2147483647),
        ("UInt32", 0, 4294967295),
        ("Int64", -9223372036854775808, 9223372036854775807),
        ("UInt64", 0, 18446744073709551615),
    ],
)
def test_a_whole_number_fits_from_the_least_to_the_largest(
    kind: str, least: int, most: int
) -> None:
    from robolink.transport.opcua.values import fits

    assert fits(kind, least)
    assert fits(kind, most)
    assert not fits(kind, least - 1)
    assert not fits(kind, most + 1)


def test_what_a_program_does_not_publish_for_writing_is_not_written(client: "OpcuaClient") -> None:
    with pytest.raises(RejectedError, match="cannot be written"):
        client.write(symbol("response"), [0] * 114)


def test_an_array_that_became_shorter_is_told(opcua_served: FarEnd) -> None:
    client = open_opcua(opcua_served.url("plc"))
    client.read([symbol("slots")])
    opcua_served.put("slots", [0] * 543)
    try:
        with pytest.raises(RemoteProtocolError, match=r"UInt16\[543\].*UInt16\[544\]"):
            client.read([symbol("slots")])
    finally:
        opcua_served.put("slots", list(range(544)))


def test_nothing_is_written_over_a_connection_that_is_not_allowed_to(opcua_served: FarEnd) -> None:
    link = open_mailbox_link(opcua_served.url(write_unsecured="no"))
    before = opcua_served.value("command")
    with pytest.raises(ConfigError, match="reading only"):
        link.write_command([9] * 64)
    with pytest.raises(ConfigError, match="reading only"):
        link.beat(9)
    assert link.read_response() == tuple(range(112))
    for opcode in Opcode:
        for release in (0, 1):
            block = encode_command(Command(7, opcode, operands=(release, 0, 0, 0)), heartbeat=9)
            assert is_stop(block) is ((opcode, release) == (Opcode.STOP, 0))
            if not is_stop(block):
                with pytest.raises(ConfigError, match="reading only"):
                    link.write_command(block)
    assert opcua_served.value("command") == before
    stop = encode_command(Command(7, Opcode.STOP), heartbeat=9)
    beat = opcua_served.value("heartbeat")
    link.write_command(stop)
    link.close()
    assert opcua_served.value("command") == list(stop)
    assert opcua_served.value("heartbeat") == beat


@pytest.mark.parametrize("locked", ["command", "heartbeat"])
def test_a_mailbox_of_which_only_half_can_be_written_is_told_before_it_is_needed(
    opcua_served: FarEnd, locked: str
) -> None:
    stop = encode_command(Command(8, Opcode.STOP))
    opcua_served.run(opcua_served.nodes[locked].set_writable(False))
    try:
        with pytest.raises(RejectedError, match=f"{locked} .*cannot be written"):
            open_mailbox_link(opcua_served.url())
        open_mailbox_link(opcua_served.url(write_unsecured="no")).close()
        link = open_mailbox_link(opcua_served.url(), stopping=True)
        if locked == "heartbeat":
            link.write_command(stop)
            assert opcua_served.value("command") == list(stop)
        link.close()
        for name in ("command", "heartbeat"):
            opcua_served.run(opcua_served.nodes[name].set_writable(False))
        link = open_mailbox_link(opcua_served.url())
        assert link.read_response()
        link.close()
    finally:
        for name in ("command", "heartbeat"):
            opcua_served.run(opcua_served.nodes[name].set_writable())


def test_a_structure_is_read_and_written_whole_by_its_definition(
    opcua_served: FarEnd, client: "OpcuaClient"
) -> None:
    node = opcua_served.add_structure("tool1")
    assert [field.type_name for field in client.describe("/tool1").fields] == [
        "Boolean",
        "Double[3]",
        "Structure",
    ]
    (value,) = client.read(["/tool1"])
    assert value == {"Valid": True, "Offsets": [1.0, 2.0, 3.0], "Pose": {"X": 1.5, "Y": 2.5}}
    value["Offsets"][0], value["Pose"]["X"] = 9.0, -1.0
    client.write("/tool1", value)
    written = opcua_served.run(node.read_value())
    assert (written.Valid, written.Offsets, written.Pose.X) == (True, [9.0, 2.0, 3.0], -1.0)
    for wrong in (
        value | {"Offsets": [1.0]},
        value | {"More": 1},
        value | {"Valid": 1},
        value | {"Pose": {"Y": 1.0, "X": 2.0}},
        {"Valid": True},
        [1.0],
    ):
        with pytest.raises(ConfigError, match="does not fit"):
            client.write("/tool1", wrong)
    assert client.read(["/tool1"]) == (value,)


def test_what_is_read_and_written_is_told(opcua_served: FarEnd) -> None:
    told: list[tuple[str, bytes]] = []
    with told_to(lambda at_ns, direction, data: told.append((direction, data))):
        link = open_mailbox_link(opcua_served.url())
    link.beat(258)
    link.read_response()
    link.close()
    words = b"".join(word.to_bytes(2) for word in (7, *range(112), 7))
    assert told == [("sent", b"\x01\x02"), ("received", words)]


def test_a_mailbox_of_other_variables_is_told(opcua_served: FarEnd) -> None:
    with pytest.raises(RejectedError, match="has no command"):
        open_mailbox_link(opcua_served.url(symbols="/Server"))
    way = "/DeviceSet/PLC/Resources/Application/GlobalVars/RL_Symbols"
    named = open_mailbox_link(opcua_served.url(symbols=way))
    assert named.identity == parse_url(opcua_served.url(symbols=way)).address
    named.close()


def test_without_asyncua_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "asyncua", None)
    with pytest.raises(ConfigError, match="asyncua") as caught:
        open_mailbox_link("softmotion+opcua://192.0.2.1?security=none")
    assert "pip install 'robolink[opcua]'" in caught.value.remedy
