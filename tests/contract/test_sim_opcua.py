"""A simulated PLC as an OPC UA server, met by a client that is not ours."""

import asyncio
import socket
import threading
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace, NodeManagementService
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from robolink_simulators.faults import PlcFault, PlcFaultAction
from robolink_simulators.hosting.fieldbus.opcua import serve_opcua
from robolink_simulators.hosting.fieldbus.opcua_nodes import StandardNodes
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.testkit.media import served

import robolink
from robolink.errors import ConfigError, ConnectError, LoginRefusedError, RobolinkError
from robolink.model import MotionProfile, Path, Secret, WorkBox
from robolink.protocols.mailbox import COMMAND_WORDS, decode_response
from tests.contract._opcua_peer import OpcuaPeer

pytestmark = pytest.mark.simulator_only

DEVICE = "Simulated SoftMotion PLC"
COMMAND, RESPONSE = "RL_Symbols.command", "RL_Symbols.response"
SLOTS, HEARTBEAT = "RL_Symbols.slots", "RL_Symbols.heartbeat"
TOOL = robolink.ToolOffset(1.25, -0.4, 60.0)
WORDS = [*range(1, COMMAND_WORDS + 1)]


@pytest.fixture
def plc():
    return SoftMotionSimulator(seed=3)


@pytest.fixture
def host(plc):
    with serve_opcua(plc) as host:
        yield host


@pytest.fixture
def peer(host):
    with OpcuaPeer(host.url, DEVICE) as peer:
        yield peer


def test_the_variables_stand_where_a_codesys_runtime_has_them(peer):
    names = peer.do(lambda client: client.get_namespace_array())
    assert names[4] == "CODESYSSPV3/3S/IecVarAccess"
    assert peer.node(RESPONSE).nodeid.to_string() == (
        f"ns=4;s=|var|{DEVICE}.Application.RL_Symbols.response"
    )


def test_standard_nodes_lead_to_each_other_and_say_what_they_are(peer):
    async def found(client):
        status = await client.nodes.server.get_child(["0:ServerStatus"])
        clock = await status.get_child(["0:CurrentTime"])
        return await clock.read_value(), await status.get_references()

    now, references = peer.do(found)
    assert abs(datetime.now(UTC) - now.replace(tzinfo=UTC)).total_seconds() < 10
    assert {
        (47, False, "Server", "Object", 2004),
        (40, True, "ServerStatusType", "VariableType", 0),
        (47, True, "CurrentTime", "Variable", 63),
    } <= {
        (
            one.ReferenceTypeId.Identifier,
            one.IsForward,
            one.BrowseName.Name,
            one.NodeClass.name,
            one.TypeDefinition.Identifier,
        )
        for one in references
    }


@pytest.mark.soak
def test_each_standard_node_is_as_asyncua_makes_it():
    from asyncua.server.standard_address_space import standard_address_space

    space = AddressSpace()
    standard_address_space.fill_address_space(NodeManagementService(space))
    nodes = StandardNodes()
    assert {*nodes} == {*space.keys()}
    for number in nodes:
        made, due = nodes[number], space[number]
        values = [
            {attribute: held.value for attribute, held in node.attributes.items()}
            for node in (made, due)
        ]
        assert values[0] == values[1], number
        references = [
            {(one.ReferenceTypeId, one.NodeId): one for one in node.references}
            for node in (made, due)
        ]
        assert references[0] == references[1], number
        assert len(made.references) == len(due.references)


def test_each_variable_tells_its_type_its_length_and_who_may_write(peer):
    ids = ua.AttributeIds
    asked = (ids.DataType, ids.ValueRank, ids.ArrayDimensions, ids.AccessLevel)
    for path, length, access in (
        (COMMAND, 64, 3),
        (RESPONSE, 114, 1),
        (SLOTS, 544, 1),
        (HEARTBEAT, None, 3),
    ):
        kind, rank, size, level = (peer.answers(path, attribute=one)[0].Value for one in asked)
        assert kind.Value.Identifier == ua.VariantType.UInt16.value
        assert (rank.Value, size.Value) == ((1, [length]) if length else (-1, None))
        assert level.Value == access


def test_reads_answer_from_the_memory_of_the_plc_at_that_moment(plc, peer):
    response, slots = peer.read(RESPONSE, SLOTS)
    assert response[0] == response[-1]
    assert decode_response(response[1:-1]).boot_id == plc.plc.memory.boot_id
    with plc.lock:
        assert slots == list(plc.plc.output(plc.now_ns)[112:])
    plc.panel.freeze()
    frozen = peer.read(RESPONSE)
    assert peer.read(RESPONSE) == frozen


def test_a_command_is_written_in_one_act_and_never_touches_the_heartbeat(plc, peer):
    assert peer.write(HEARTBEAT, 777) == "Good"
    assert peer.write(COMMAND, WORDS) == "Good"
    with plc.lock:
        inbox = plc.plc.program.inbox
        assert inbox.words == (*WORDS[:62], 777, WORDS[63])
    assert peer.read(COMMAND, HEARTBEAT) == [[*WORDS[:62], 777, WORDS[63]], 777]


REFUSED: tuple[tuple[Any, ...], ...] = (
    (COMMAND, WORDS[:-1], "UInt16", {}, "BadTypeMismatch"),
    (COMMAND, [*WORDS, 1], "UInt16", {}, "BadTypeMismatch"),
    (COMMAND, 1, "UInt16", {}, "BadTypeMismatch"),
    (COMMAND, WORDS, "Int16", {}, "BadTypeMismatch"),
    (HEARTBEAT, [1], "UInt16", {}, "BadTypeMismatch"),
    (COMMAND, [1], "UInt16", {"index_range": "62"}, "BadIndexRangeInvalid"),
    (COMMAND, WORDS, "UInt16", {"index_range": "0:63"}, "BadIndexRangeInvalid"),
    (HEARTBEAT, 1, "UInt16", {"SourceTimestamp": datetime.now(UTC)}, "BadWriteNotSupported"),
    (RESPONSE, [0] * 114, "UInt16", {}, "BadNotWritable"),
)


def test_what_a_variable_does_not_take_changes_nothing(plc, peer):
    for path, value, kind, given, status in REFUSED:
        assert peer.write(path, value, kind, **given) == status
        with plc.lock:
            assert not any(plc.plc.program.inbox.words)
    shown = [line[1:] for line in plc.log if "write" in line[2] or "beat" in line[2]]
    assert shown == [(">", f"write {path} (refused)") for path, *_ in REFUSED]


def test_a_range_of_an_array_is_not_read_either(peer):
    (answer,) = peer.answers(RESPONSE, index_range="0:3")
    assert answer.StatusCode.name == "BadIndexRangeInvalid"


def test_a_request_names_a_hundred_nodes_at_most(peer):
    told = peer.do(lambda client: client.get_node("i=11705").read_value())
    assert len(peer.read(*[HEARTBEAT] * told)) == told == 100
    with pytest.raises(ua.uaerrors.BadTooManyOperations):
        peer.read(*[HEARTBEAT] * 101)


def test_a_watched_variable_tells_when_the_plc_changes_it(plc, peer):
    seen: list[list[int]] = []

    class Handler:
        def datachange_notification(self, node, value, data):
            seen.append(value)

    command = peer.node(COMMAND)

    async def watch(client):
        subscription = await client.create_subscription(50, Handler())
        await subscription.subscribe_data_change(command)
        with plc.lock:
            plc.write(0, WORDS, plc.now_ns)
        for _ in range(100):
            if len(seen) > 1:
                return
            await asyncio.sleep(0.02)

    peer.do(watch)
    assert [value[0] for value in seen[:2]] == [0, 1]


def test_our_client_writes_a_tool_and_moves_the_robot_to_its_end(plc):
    with served(plc, "opcua") as url, robolink.connect(url) as controller:
        old = controller.tools.read(3)
        controller.tools.write(3, TOOL, expected=old)
        assert controller.tools.read(3) == TOOL
        group = controller.groups[0]
        here = group.pose()
        there = replace(here, z_mm=here.z_mm + 2)
        box = WorkBox.around(here, xy_mm=20, below_mm=5, above_mm=50)
        profile = MotionProfile(Path.STRAIGHT, speed_mm_s=20)
        assert group.move_to(there, profile, box=box).wait(timeout_s=20).name == "ARRIVED"
        assert group.pose().z_mm == pytest.approx(there.z_mm, abs=1e-6)
    assert plc.counters()["moves_started"] == 1


def test_our_client_does_the_same_signed_and_encrypted(plc, robolink_state, own_certificate):
    with served(plc, "opcua-secured") as url, robolink.connect(url) as controller:
        old = controller.tools.read(3)
        controller.tools.write(3, TOOL, expected=old)
        assert controller.tools.read(3) == TOOL
    assert "security=" not in url


def test_our_client_comes_in_as_the_user_of_the_server(plc, robolink_state, own_certificate):
    users = {"ada": Secret("correct-horse")}
    with serve_opcua(plc, users=users) as host:
        with robolink.connect(host.secured_url, password="correct-horse") as controller:
            controller.tools.write(3, TOOL, expected=controller.tools.read(3))
        with pytest.raises(LoginRefusedError):
            robolink.connect(host.secured_url, password="wrong-horse")


@pytest.mark.usefixtures("robolink_state", "own_certificate")
def test_our_client_refuses_a_certificate_that_ended_or_is_another_one(plc):
    with serve_opcua(plc, expired=True) as host, pytest.raises(ConfigError, match="counts from"):
        robolink.connect(host.secured_url)
    with serve_opcua(plc) as host:
        robolink.connect(host.secured_url).close()
        plc.faults.add(PlcFault(PlcFaultAction.EXPIRED_CERTIFICATE))
        with robolink.connect(host.secured_url) as controller:
            controller.status()  # who is in stays in
        with pytest.raises(RobolinkError, match="another certificate"):
            robolink.connect(host.secured_url)


@pytest.mark.parametrize("act", ["cut_link", "restart"])
def test_a_pulled_cable_and_a_restart_end_the_connection(plc, host, peer, act):
    peer.read(RESPONSE)
    getattr(plc.panel, act)()
    with pytest.raises((OSError, ua.UaError, TimeoutError)):
        peer.read(RESPONSE)
    with OpcuaPeer(host.url, DEVICE) as again:
        assert again.read(RESPONSE)


def test_an_encrypted_session_finds_the_certificate_that_the_url_tells(host):
    with OpcuaPeer(host.url, DEVICE, secured=True) as peer:
        assert peer.read(RESPONSE)
        endpoints = peer.do(lambda client: client.get_endpoints())
    shown = {x509.load_der_x509_certificate(one.ServerCertificate) for one in endpoints}
    assert [one.fingerprint(hashes.SHA256()).hex() for one in shown] == [host.fingerprint]
    assert f"server_certificate={host.fingerprint}" in host.secured_url
    offered = {
        (one.SecurityPolicyUri.partition("#")[2], one.SecurityMode.name) for one in endpoints
    }
    assert offered == {
        ("None", "None_"),
        ("Basic256Sha256", "SignAndEncrypt"),
        ("Aes128_Sha256_RsaOaep", "SignAndEncrypt"),
        ("Aes256_Sha256_RsaPss", "SignAndEncrypt"),
    }


def test_only_a_named_user_is_let_in(plc):
    with serve_opcua(plc, users={"ada": Secret("correct-horse")}) as host:
        assert "user=ada" in host.url
        assert "correct-horse" not in host.url + host.secured_url
        with OpcuaPeer(host.url, DEVICE, user=("ada", "correct-horse")) as peer:
            assert peer.read(RESPONSE)
        for user in (None, ("ada", "wrong-horse"), ("bob", "correct-horse"), ("ada", "")):
            with pytest.raises(ua.UaError), OpcuaPeer(host.url, DEVICE, user=user):
                pass


def test_what_a_hook_raises_goes_to_the_host_which_ends(plc, host, peer, monkeypatch):
    told: list[BaseException | None] = []
    monkeypatch.setattr(threading, "excepthook", lambda details: told.append(details.exc_value))

    def fail(_number, _text):
        raise RuntimeError("no more")

    plc.on_request = fail
    with pytest.raises((OSError, ua.UaError, TimeoutError)):
        peer.read(RESPONSE)
    assert [str(error) for error in told] == ["no more"]
    for thread in threading.enumerate():
        if thread.name == "opcua host":
            thread.join(5)
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", int(host.url.split(":")[2].split("?")[0])), 1)


def test_it_listens_on_this_computer_only_and_says_what_port_is_taken(plc, host):
    port = int(host.url.split(":")[2].split("?")[0])
    with pytest.raises(ConnectError):
        serve_opcua(plc, port=port)
    with pytest.raises(ConfigError, match="other machines"):
        serve_opcua(plc, "0.0.0.0")


def test_a_host_that_was_closed_leaves_nothing_behind(plc):
    host = serve_opcua(plc)
    assert plc.url == host.url
    host.close()
    host.close()
    assert (plc.url, plc.watchers) == ("", [])
    assert not [one for one in threading.enumerate() if one.name == "opcua host"]
