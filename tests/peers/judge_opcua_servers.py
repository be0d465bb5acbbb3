"""Our links and drivers over OPC UA at servers of others: node-opcua and Eclipse Milo.

Each of them keeps the mailbox of a simulated PLC, which it reaches over Modbus TCP, so that whole
tool writes and movements pass through it, and tools of a machine of its own.
"""

from contextlib import ExitStack, closing
from dataclasses import replace

import pytest
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink import ToolOffset
from robolink.errors import (
    ConfigError,
    ConnectError,
    LoginRefusedError,
    NotReadyError,
    RejectedError,
    ToolChangedError,
    TransportError,
)
from robolink.model import MotionProfile, Path, Secret, WorkBox
from robolink.protocols.mailbox import PROBE, Opcode, decode_response
from robolink.testing import confirm_whole_map
from robolink.transport import open_mailbox_link, parse_url
from robolink.transport.opcua.opening import open_opcua
from tests.peers import _opcua_stacks
from tests.peers._opcua_stacks import STACKS, StackServer
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


@pytest.fixture(scope="module", params=STACKS)
def stack(request):
    """Whose server."""
    return request.param


@pytest.fixture(scope="module")
def server(stack, plc, tmp_path_factory):
    """A server before that PLC; it takes ten seconds to start."""
    with StackServer(stack, tmp_path_factory.mktemp("server"), plc[1]) as server:
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


@pytest.mark.parametrize(
    ("stack", "outcome"), [("node-opcua", pytest.fail.Exception), ("Milo", pytest.skip.Exception)]
)
def test_a_stack_that_is_not_here_is_told(monkeypatch, tmp_path, stack, outcome):
    monkeypatch.setattr(_opcua_stacks, "MODULES", tmp_path)
    monkeypatch.setattr(_opcua_stacks, "ARCHIVES", tmp_path)
    monkeypatch.delenv("MILO_CLASSPATH", raising=False)
    with pytest.raises((pytest.fail.Exception, pytest.skip.Exception)) as told:
        StackServer(stack, tmp_path, 0)
    assert isinstance(told.value, outcome)
    assert "make peers fetches it" in str(told.value)


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


MAP = f"""\
schema = "robolink/plc-map/1"
name = "judge"
[numbers]
root = "{VARIABLE}.GVL."
type = "LREAL"
[[tools]]
number = 1
node = "aTool1"
length = 6
x = {{ element = 0 }}
y = {{ element = 1 }}
z = {{ element = 2 }}
u = {{ element = 3 }}
[cycle_counter]
node = "uiCycle"
[permit]
node = "xPermit"
[commit]
kind = "none"
settle_s = 0.05
"""
FIRST = ToolOffset(12.0, -3.5, -20.0, 15.0)


@pytest.fixture
def mapped(tmp_path):
    """Returns the URL of a machine with a map, at a port."""
    path = tmp_path / "judge.toml"
    path.write_text(MAP)
    return lambda port: f"plc+opcua://127.0.0.1:{port}?map={path}&{PLAIN}"


def test_the_driver_of_a_map_writes_a_tool_once(mapped, server):
    with robolink.connect(mapped(server.port)) as controller:
        confirm_whole_map(controller)
        assert controller.tools.same(controller.tools.read(1), FIRST)
        receipt = controller.tools.write(1, NEW, expected=FIRST)
        assert controller.tools.same(receipt.read_back, NEW)
        with pytest.raises(ToolChangedError):
            controller.tools.write(1, FIRST, expected=FIRST)
    assert server.wrote("aTool1") == [[NEW.x_mm, NEW.y_mm, NEW.z_mm, NEW.u_deg, 0, 0]]


def test_the_driver_of_a_map_writes_nothing_without_the_machines_permit(mapped, server):
    server.tell(set="xPermit", value=False)
    with robolink.connect(mapped(server.port)) as controller:
        confirm_whole_map(controller)
        with pytest.raises(NotReadyError, match="xPermit"):
            controller.tools.write(1, NEW, expected=FIRST)
    assert server.wrote("aTool1") == []


def test_what_is_written_after_the_server_has_restarted_is_not_sent(stack, plc, mapped, tmp_path):
    with ExitStack() as gone:
        first = gone.enter_context(StackServer(stack, tmp_path, plc[1]))
        controller = gone.enter_context(robolink.connect(mapped(first.port)))
        confirm_whole_map(controller)
        assert controller.tools.same(controller.tools.read(1), FIRST)
        first.kill()
        with StackServer(stack, tmp_path, plc[1], f"--port={first.port}") as again:
            with pytest.raises(TransportError):
                controller.tools.write(1, NEW, expected=FIRST)
            assert again.wrote("aTool1") == []
            with robolink.connect(mapped(first.port)) as renewed:
                renewed.tools.write(1, NEW, expected=FIRST)
            assert len(again.wrote("aTool1")) == 1


def test_a_structure_is_read_by_its_definition_or_refused_by_name(stack, client, server):
    node = f"{VARIABLE}.GVL.stTool"
    if stack == "Milo":  # has no attribute DataTypeDefinition
        with pytest.raises(RejectedError, match=r"does not define the structure of .*stTool"):
            client.read([node])
        with pytest.raises(ConfigError, match="stTool"):
            client.write(node, {"rX": 1.0})
        assert server.wrote("stTool") == []
        assert client.read([f"{VARIABLE}.GVL.xPermit"]) == (True,)
        return
    assert client.read([node]) == ({"rX": 1.5, "rY": -2.5, "rZ": 30.0, "rU": 0.0},)


USER, PASSWORD = "cell 3", "correct horse battery"


@pytest.fixture(scope="module")
def guarded(stack, plc, tmp_path_factory):
    """Its server with one user, behind the same PLC."""
    folder = tmp_path_factory.mktemp("guarded")
    with StackServer(stack, folder, plc[1], USER, PASSWORD) as server:
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


def test_a_server_that_does_not_trust_this_computer_is_told_by_name(stack, plc, tmp_path):
    with StackServer(stack, tmp_path, plc[1], USER, PASSWORD, "--refuse-certificates") as server:
        with pytest.raises((ConnectError, RejectedError, LoginRefusedError)) as told:
            open_mailbox_link(pinned(server), password=Secret(PASSWORD))
    assert "certificate" in f"{told.value.what} {told.value.remedy}"
