"""node-opcua judges OPC UA: our links at its server, and its client at our simulators.

Its server keeps the mailbox of a simulated PLC, which it reaches over Modbus TCP, so that whole
tool writes and movements pass through it.
"""

from contextlib import closing
from dataclasses import replace

import pytest
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.testkit.media import served

import robolink
from robolink import ToolOffset
from robolink.errors import ConfigError, ConnectError, LoginRefusedError, RejectedError
from robolink.model import MotionProfile, Path, Secret, WorkBox
from robolink.protocols.mailbox import PROBE, Opcode, decode_response
from robolink.transport import open_mailbox_link, parse_url
from robolink.transport.opcua.opening import open_opcua
from tests.peers import _node_opcua
from tests.peers._node_opcua import NodeClient, NodeLink, NodeServer
from tests.unit._mailbox_client import MailboxClient

PLAIN = "security=none&write_unsecured=yes"
VARIABLE = "ns=4;s=|var|Judge.Application"
NEW = ToolOffset(11.25, -3.125, -20.5, 12.0)
SLOT = 3


@pytest.fixture(scope="module")
def plc():
    """A simulated PLC over Modbus TCP."""
    simulator = SoftMotionSimulator(seed=5)
    with serve_modbus_tcp(simulator) as host:
        yield simulator, parse_url(host.url).port


@pytest.fixture(scope="module")
def server(plc, tmp_path_factory):
    """node-opcua's server before that PLC; it takes ten seconds to start."""
    with NodeServer(tmp_path_factory.mktemp("server"), plc[1]) as server:
        yield server


@pytest.fixture(autouse=True)
def _as_it_was(request):
    if "server" in request.fixturenames:
        request.getfixturevalue("server").forget()


@pytest.fixture
def mailbox(server):
    """A URL of its mailbox."""
    return f"softmotion+opcua://127.0.0.1:{server.port}?{PLAIN}"


@pytest.fixture
def client(server):
    """Our client at its server."""
    url = parse_url(f"plc+opcua://127.0.0.1:{server.port}?{PLAIN}")
    with closing(open_opcua(url)) as client:
        yield client


def test_without_node_opcua_this_judge_fails(monkeypatch, tmp_path):
    monkeypatch.setattr(_node_opcua, "MODULES", tmp_path)
    with pytest.raises((pytest.fail.Exception, pytest.skip.Exception)) as told:
        NodeServer(tmp_path, 0)
    assert isinstance(told.value, pytest.fail.Exception)


def test_each_type_is_read_as_what_it_is(client):
    tool, real, permit, cycle = client.read(
        [f"{VARIABLE}.GVL.{name}" for name in ("aTool1", "aReal", "xPermit", "uiCycle")]
    )
    assert list(tool) == [12.0, -3.5, -20.0, 15.0, 0.0, 0.0]
    assert list(real) == [0.0] * 6
    assert permit is True
    assert isinstance(cycle, int)


def test_an_array_is_written_whole_and_read_back(client, server):
    node = f"{VARIABLE}.GVL.aTool1"
    client.write(node, [1.0, -2.5, 3.25, 0.0, 0.0, 1e-9])
    assert list(client.read([node])[0]) == [1.0, -2.5, 3.25, 0.0, 0.0, 1e-9]
    assert server.wrote("aTool1") == [[1, -2.5, 3.25, 0, 0, 1e-9]]


@pytest.mark.parametrize("value", [[1.0] * 5, [1.0] * 7, 1.0, []])
def test_a_value_of_another_length_never_reaches_it(client, server, value):
    with pytest.raises(ConfigError, match="aTool1"):
        client.write(f"{VARIABLE}.GVL.aTool1", value)
    assert server.wrote("aTool1") == []


def test_what_may_only_be_read_is_a_refusal_by_name_and_the_link_goes_on(client):
    with pytest.raises(RejectedError, match="aShown"):
        client.write(f"{VARIABLE}.GVL.aShown", [1.0] * 6)
    with pytest.raises(RejectedError, match="BadNodeIdUnknown"):
        client.read([f"{VARIABLE}.GVL.aTool9"])
    assert client.read([f"{VARIABLE}.GVL.xPermit"]) == (True,)


def test_a_node_is_found_by_its_path(client):
    path = "/DeviceSet/Judge/Resources/Application/GlobalVars/GVL/aTool2"
    assert list(client.read([path])[0]) == [-12.0, -3.5, -21.0, 0.0, 0.0, 0.0]


def test_the_mailbox_reads_and_takes_commands(mailbox, plc):
    with closing(open_mailbox_link(mailbox)) as link:
        now = decode_response(link.read_response())
        assert now.probe == PROBE
        client = MailboxClient(link)
        client.take()
        pose = (1.0, 2.0, 3.0, 0.0, 0.0, 0.0)
        client.done(Opcode.WRITE_TOOL, SLOT, pose=pose)
        assert client.slot(SLOT).tool == pose
        assert len(link.read_device()) == 4
        client.done(Opcode.OWNERSHIP, 0)
    assert plc[0].plc.memory.slot(SLOT).tool == pose


def test_the_driver_writes_a_tool_and_moves(mailbox, plc):
    with robolink.connect(mailbox) as controller:
        before = controller.tools.read(SLOT)
        receipt = controller.tools.write(SLOT, NEW, expected=before)
        assert controller.tools.same(receipt.read_back, NEW)
        controller.motors(True)
        group = controller.groups[0]
        up = replace(group.pose(), z_mm=group.pose().z_mm + 5)
        profile = MotionProfile(Path.STRAIGHT, speed_mm_s=10)
        group.move_to(up, profile, box=WorkBox()).wait(timeout_s=20)
        assert group.pose().z_mm == pytest.approx(up.z_mm, abs=0.01)
    assert plc[0].plc.memory.slot(SLOT).tool[:4] == (NEW.x_mm, NEW.y_mm, NEW.z_mm, NEW.u_deg)


USER, PASSWORD = "cell 3", "correct horse battery"


@pytest.fixture(scope="module")
def guarded(plc, tmp_path_factory):
    """Its server with one user, behind the same PLC."""
    with NodeServer(tmp_path_factory.mktemp("guarded"), plc[1], USER, PASSWORD) as server:
        yield server


def pinned(server, **options):
    told = {"server_certificate": server.sha256, "user": "cell%203", **options}
    query = "&".join(f"{name}={value}" for name, value in told.items() if value)
    return f"softmotion+opcua://127.0.0.1:{server.port}?{query}"


@pytest.mark.parametrize("security", ["Basic256Sha256", "Aes256Sha256RsaPss"])
def test_its_user_is_let_in_by_an_encrypted_channel_to_the_pinned_server(guarded, security):
    with closing(
        open_mailbox_link(pinned(guarded, security=security), password=Secret(PASSWORD))
    ) as link:
        assert decode_response(link.read_response()).probe == PROBE
        link.beat(0x0102)
    assert guarded.next("wrote") == "heartbeat"


@pytest.mark.parametrize(
    ("options", "password", "error", "why"),
    [
        ({}, "staple battery horse", LoginRefusedError, USER),
        ({"user": "nobody"}, PASSWORD, LoginRefusedError, "nobody"),
        ({"user": ""}, "", LoginRefusedError, "without a user|anonymous|nobody"),
        ({"server_certificate": "ab" * 32}, PASSWORD, ConfigError, "another certificate"),
        ({"security": "Aes128Sha256RsaOaep"}, PASSWORD, RejectedError, "Aes128Sha256RsaOaep"),
    ],
    ids=["password", "user", "anonymous", "certificate", "policy"],
)
def test_who_may_not_is_told_why(guarded, options, password, error, why):
    secret = Secret(password) if password else None
    with pytest.raises(error, match=why):
        open_mailbox_link(pinned(guarded, **options), password=secret)


def test_a_server_that_does_not_trust_this_computer_is_told_by_name(plc, tmp_path):
    with NodeServer(tmp_path, plc[1], USER, PASSWORD, "--refuse-certificates") as server:
        with pytest.raises((ConnectError, RejectedError, LoginRefusedError)) as told:
            open_mailbox_link(pinned(server), password=Secret(PASSWORD))
    assert "certificate" in f"{told.value.what} {told.value.remedy}"


@pytest.fixture(scope="module")
def pki(tmp_path_factory):
    """The certificates of its client."""
    return tmp_path_factory.mktemp("client")


@pytest.fixture
def ours():
    """Our simulated PLC over OPC UA, and its URL."""
    simulator = SoftMotionSimulator(seed=5)
    with served(simulator, "opcua") as url:
        yield simulator, url


def endpoint(url):
    parsed = parse_url(url)
    return f"opc.tcp://{parsed.host}:{parsed.port}"


def tree_of(client):
    """Browse to the mailbox, as a person with a browser does; returns the root of its node ids."""
    path = ["DeviceSet"]
    (device,) = client.do("browse", path=path)["children"]
    path += [device, "Resources", "Application", "GlobalVars", "RL_Symbols"]
    found = client.do("browse", path=path)
    assert set(found["children"]) >= {"command", "response", "slots", "heartbeat"}
    return f"ns=4;s=|var|{device}.Application.RL_Symbols"


@pytest.mark.parametrize("policy", ["None", "Basic256Sha256", "Aes256_Sha256_RsaPss"])
def test_its_client_writes_a_tool_that_robolink_reads_back(ours, pki, policy):
    _simulator, url = ours
    with NodeClient(pki, endpoint(url), policy) as node:
        tree = tree_of(node)
        client = MailboxClient(NodeLink(node, tree))
        client.take()
        pose = (NEW.x_mm, NEW.y_mm, NEW.z_mm, NEW.u_deg, 0.0, 0.0)
        client.done(Opcode.WRITE_TOOL, SLOT, pose=pose, name="node-opcua")
        client.done(Opcode.OWNERSHIP, 0)
    with robolink.connect(url) as controller:
        assert controller.tools.same(controller.tools.read(SLOT), NEW)


def test_its_client_reads_every_node_with_its_type_and_length(ours, pki):
    _simulator, url = ours
    with NodeClient(pki, endpoint(url)) as node:
        tree = tree_of(node)
        names = ("command", "response", "slots", "heartbeat")
        got = node.do("read", nodes=[f"{tree}.{name}" for name in names])
    assert {(one["status"], one["type"]) for one in got} == {("Good", "UInt16")}
    assert [len(one["value"]) for one in got[:3]] == [64, 114, 544]
    assert decode_response(tuple(got[1]["value"][1:-1])).probe == PROBE


def test_its_client_is_told_of_a_change_that_it_subscribed_to(ours, pki):
    _simulator, url = ours
    with NodeClient(pki, endpoint(url)) as node:
        tree = tree_of(node)
        node.do("watch", node=f"{tree}.response")
        first = node.next("value")
        later = node.next("value")
        assert first != later, "the PLC's heartbeat counts"


@pytest.mark.parametrize(
    ("name", "given", "status"),
    [
        ("command", {"type": "UInt16", "value": [1] * 4, "range": "0:3"}, "BadIndexRangeInvalid"),
        ("command", {"type": "UInt16", "value": [1] * 63}, "BadTypeMismatch"),
        ("command", {"type": "Int16", "value": [1] * 64}, "BadTypeMismatch"),
        ("response", {"type": "UInt16", "value": [1] * 114}, "BadNotWritable"),
        ("heartbeat", {"type": "UInt16", "value": [1]}, "BadTypeMismatch"),
    ],
    ids=["a part", "too short", "another type", "read only", "an array"],
)
def test_our_simulator_refuses_its_client_what_a_plc_would(ours, pki, name, given, status):
    _simulator, url = ours
    with NodeClient(pki, endpoint(url)) as node:
        tree = tree_of(node)
        before = node.do("read", nodes=[f"{tree}.command"])[0]["value"]
        assert node.do("write", node=f"{tree}.{name}", **given) == {"status": status}
        assert node.do("read", nodes=[f"{tree}.command"])[0]["value"] == before
