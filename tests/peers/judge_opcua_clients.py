"""Clients of others at our simulators over OPC UA: those of node-opcua and Eclipse Milo."""

import struct
from pathlib import Path

import pytest
from robolink_simulators.hosting.fieldbus.opcua import serve_opcua
from robolink_simulators.plc import PlcSimulator, serve_plc_opcua
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.testkit.media import served

import robolink
from robolink import ToolOffset
from robolink.model import Secret
from robolink.protocols.mailbox import PROBE, Opcode, decode_response
from robolink.register_maps import load_symbol_map
from robolink.transport import parse_url
from tests.peers._opcua_stacks import STACKS, StackClient, StackLink
from tests.unit._mailbox_client import MailboxClient

NEW = ToolOffset(11.25, -3.125, -20.5, 12.0)
SLOT = 3
ARRAYS = Path("examples/plc-maps/by-symbol.toml")
USER, PASSWORD = "cell 3", "correct horse battery"


@pytest.fixture(scope="module", params=STACKS)
def stack(request):
    """Whose client."""
    return request.param


@pytest.fixture(scope="module")
def pki(tmp_path_factory):
    """The certificates of its client."""
    return tmp_path_factory.mktemp("client")


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


@pytest.fixture(scope="module")
def mailbox(stack, pki):
    """Their client, without security, at our simulated PLC, and where the mailbox is there."""
    with served(SoftMotionSimulator(seed=5), "opcua") as url:
        with StackClient(stack, pki, endpoint(url)) as peer:
            yield peer, tree_of(peer)


def write_tool(peer, name):
    """Write a tool through the mailbox as our own client would."""
    client = MailboxClient(StackLink(peer, tree_of(peer)))
    client.take()
    pose = (NEW.x_mm, NEW.y_mm, NEW.z_mm, NEW.u_deg, 0.0, 0.0)
    client.done(Opcode.WRITE_TOOL, SLOT, pose=pose, name=name)
    client.done(Opcode.OWNERSHIP, 0)


@pytest.mark.parametrize("policy", ["None", "Basic256Sha256", "Aes256_Sha256_RsaPss"])
def test_its_client_writes_a_tool_that_robolink_reads_back(stack, pki, policy):
    with served(SoftMotionSimulator(seed=5), "opcua") as url:
        with StackClient(stack, pki, endpoint(url), policy) as peer:
            write_tool(peer, stack)
        with robolink.connect(url) as controller:
            assert controller.tools.same(controller.tools.read(SLOT), NEW)


def test_its_client_reads_every_node_with_its_type_and_length(mailbox):
    peer, tree = mailbox
    names = ("command", "response", "slots", "heartbeat")
    got = peer.do("read", nodes=[f"{tree}.{name}" for name in names])
    assert {(one["status"], one["type"]) for one in got} == {("Good", "UInt16")}
    assert [len(one["value"]) for one in got[:3]] == [64, 114, 544]
    assert decode_response(tuple(got[1]["value"][1:-1])).probe == PROBE


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
def test_our_simulator_refuses_its_client_what_a_plc_would(mailbox, name, given, status):
    peer, tree = mailbox
    before = peer.do("read", nodes=[f"{tree}.command"])[0]["value"]
    assert peer.do("write", node=f"{tree}.{name}", **given) == {"status": status}
    assert peer.do("read", nodes=[f"{tree}.command"])[0]["value"] == before


def test_its_client_is_told_of_a_change_that_it_subscribed_to(mailbox):
    peer, tree = mailbox
    peer.do("watch", node=f"{tree}.response")
    first = peer.next("value")
    later = peer.next("value")
    assert first != later, "the PLC's heartbeat counts"


@pytest.fixture(scope="module")
def guarded():
    """Our simulated PLC over OPC UA with one user."""
    with serve_opcua(SoftMotionSimulator(seed=5), users={USER: Secret(PASSWORD)}) as host:
        yield host


def test_its_user_writes_a_tool_by_an_encrypted_channel(guarded, stack, pki):
    server = endpoint(guarded.url)
    with StackClient(stack, pki, server, "Basic256Sha256", USER, PASSWORD) as peer:
        write_tool(peer, stack)
    with robolink.connect(guarded.secured_url, password=Secret(PASSWORD)) as controller:
        assert controller.tools.same(controller.tools.read(SLOT), NEW)


@pytest.mark.parametrize(
    ("policy", "user"),
    [
        ("Basic256Sha256", (USER, "staple battery horse")),
        ("Basic256Sha256", ("nobody", PASSWORD)),
        ("Basic256Sha256", ()),
        ("None", ()),
    ],
    ids=["password", "user", "anonymous", "anonymous and plain"],
)
def test_our_simulator_lets_no_other_user_of_it_in(guarded, stack, pki, policy, user):
    with StackClient(stack, pki, endpoint(guarded.url), policy, *user) as peer:
        met = peer.met()
    if user:
        assert "BadUserAccessDenied" in met or "BadIdentityToken" in met, met
    else:  # both clients see for themselves that nobody is let in without a name
        assert "anonymous" in met.lower(), met


def machine(path):
    """Returns the variables of a simulated PLC with a map, and its host."""
    symbols = load_symbol_map(path)
    return serve_plc_opcua(PlcSimulator(symbols, seed=3), path)


@pytest.fixture(scope="module")
def needles(stack, pki):
    """Their client at a machine whose tools are arrays that are taken over on a commit bit."""
    with machine(ARRAYS) as host, StackClient(stack, pki, endpoint(host.url)) as peer:
        yield peer, host.url


VARIABLES = "ns=4;s=|var|PLC.Application.GVL_Tools"


def test_its_client_reads_the_variables_of_a_map_as_what_they_are(needles):
    peer, _url = needles
    names = ("aNeedleA", "aHead", "xTakeOver", "lrProbe", "udiCycle", "uiSelected", "wInputs")
    way = ["DeviceSet", "PLC", "Resources", "Application", "GlobalVars", "GVL_Tools"]
    assert set(peer.do("browse", path=way)["children"]) >= set(names)
    got = peer.do("read", nodes=[f"{VARIABLES}.{name}" for name in names])
    assert {one["status"] for one in got} == {"Good"}
    assert [one["type"] for one in got[:4]] == ["Double", "Double", "Boolean", "Double"]
    assert (len(got[0]["value"]), len(got[1]["value"])) == (6, 4)
    assert got[3]["value"] == 12.3456


def test_its_client_has_a_tool_taken_over_that_robolink_reads_back(needles):
    peer, url = needles
    new = [NEW.x_mm, NEW.y_mm, NEW.z_mm, NEW.u_deg, 5.0, 6.0]
    for name, kind, value in (("aNeedleA", "Double", new), ("xTakeOver", "Boolean", True)):
        done = peer.do("write", node=f"{VARIABLES}.{name}", type=kind, value=value)
        assert done == {"status": "Good"}
    while not peer.do("read", nodes=[f"{VARIABLES}.xDone"])[0]["value"]:
        pass
    with robolink.connect(url) as controller:
        assert controller.tools.same(controller.tools.read(1), NEW)


SIX = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]


@pytest.mark.parametrize(
    ("name", "given", "status"),
    [
        ("aNeedleA", {"type": "Double", "value": SIX[:5]}, "BadTypeMismatch"),
        ("aNeedleA", {"type": "Double", "value": [*SIX, 7.0]}, "BadTypeMismatch"),
        ("aNeedleA", {"type": "Float", "value": SIX}, "BadTypeMismatch"),
        ("aNeedleA", {"type": "Double", "value": 1.0}, "BadTypeMismatch"),
        ("aNeedleA", {"type": "Double", "value": SIX, "stamped": True}, "BadWriteNotSupported"),
        ("aNeedleA", {"type": "Double", "value": SIX[:2], "range": "0:1"}, "BadIndexRangeInvalid"),
        ("xTakeOver", {"type": "Byte", "value": 1}, "BadTypeMismatch"),
        ("xDone", {"type": "Boolean", "value": True}, "BadNotWritable"),
        ("udiDeviceId", {"type": "UInt32", "value": 1}, "BadNotWritable"),
        ("aNeedleC", {"type": "Double", "value": SIX}, "BadNodeIdUnknown"),
    ],
    ids=[
        "too short",
        "too long",
        "another type",
        "no array",
        "a timestamp",
        "a part",
        "no bit",
        "the PLC's signal",
        "the PLC's name",
        "no such variable",
    ],
)
def test_a_simulated_machine_refuses_its_client(needles, name, given, status):
    peer, _url = needles
    before = peer.do("read", nodes=[f"{VARIABLES}.aNeedleA"])[0]["value"]
    assert peer.do("write", node=f"{VARIABLES}.{name}", **given) == {"status": status}
    assert peer.do("read", nodes=[f"{VARIABLES}.aNeedleA"])[0]["value"] == before


STRUCTURE = """\
schema = "robolink/plc-map/1"
name = "a structure"
commit.kind = "none"
[[tools]]
number = 1
node = "ns=4;s=|var|PLC.Application.GVL.stTool"
x = { field = "rX", type = "REAL" }
y = { field = "rY", type = "REAL" }
z = { field = "lrZ", type = "LREAL" }
"""


def test_the_bytes_of_a_structure_that_milo_writes_are_those_that_robolink_reads(tmp_path, pki):
    """node-opcua's client takes structures apart itself: here the bytes are ours to choose."""
    path = tmp_path / "structure.toml"
    path.write_text(STRUCTURE)
    node = "ns=4;s=|var|PLC.Application.GVL.stTool"
    with machine(path) as host:
        with StackClient("Milo", pki, endpoint(host.url)) as peer:
            (got,) = peer.do("read", nodes=[node])
            assert (got["status"], got["type"]) == ("Good", "ExtensionObject")
            assert len(struct.unpack("<ffd", bytes.fromhex(got["value"]["body"]))) == 3
            for body, status in (
                (struct.pack("<ffd", 1.5, -2.25, -20.125), "Good"),
                (struct.pack("<ff", 9.0, 9.0), "BadTypeMismatch"),
                (struct.pack("<ffdd", 9.0, 9.0, 9.0, 9.0), "BadTypeMismatch"),
            ):
                value = {**got["value"], "body": body.hex()}
                done = peer.do("write", node=node, type="ExtensionObject", value=value)
                assert done == {"status": status}
        with robolink.connect(host.url) as controller:
            assert controller.tools.same(controller.tools.read(1), ToolOffset(1.5, -2.25, -20.125))
