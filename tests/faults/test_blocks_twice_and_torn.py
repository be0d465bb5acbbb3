"""A PLC's command blocks and answers when lost, doubled, torn or at the limit of their numbers.

Over Modbus TCP, Modbus RTU, CANopen and OPC UA as real links; the PLC itself counts the movements
begun and the changes of a slot.
"""

from contextlib import closing

import pytest
from robolink_simulators.faults import PlcFault, PlcFaultAction
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink import ToolOffset
from robolink.errors import OutcomeUnknownError, RemoteProtocolError, RobolinkError
from robolink.model import Verdict, WorkBox
from robolink.protocols.mailbox import Opcode, encode_command
from robolink.transaction import recover
from robolink.transport import open_mailbox_link
from tests.contract._softmotion_cell import OWNER_SILENCE_S, QUICK, above, served
from tests.unit._mailbox_client import MailboxClient

LINKS = ["modbus-tcp", "modbus-rtu", "can-virtual", "opcua"]
SLOT = 15
NEW = ToolOffset(11.25, -3.125, -20.5, 12.0)
TIMEOUT_S = 0.8
HIGHEST = 0xFFFF


def lift(controller, by_mm=2.0):
    group = controller.groups[0]
    group.move_to(above(group.pose(), by_mm), QUICK, box=WorkBox()).wait(timeout_s=10)


@pytest.fixture(params=LINKS)
def cell(request):
    with served(request.param, SoftMotionSimulator(seed=7)) as cell:
        yield cell


def only(*links):
    """These links in each run of the tests, all links in ``make soak``."""
    others = [pytest.param(link, marks=pytest.mark.soak) for link in LINKS if link not in links]
    return pytest.mark.parametrize("cell", [*links, *others], indirect=True)


@pytest.mark.fault("F25")
@pytest.mark.parametrize(
    ("cell", "how"),
    [
        ("modbus-tcp", PlcFaultAction.DROP_REPLY),
        ("modbus-rtu", PlcFaultAction.GARBLE_REPLY),
        *(
            pytest.param(link, how, marks=pytest.mark.soak)
            for link, how in (
                ("modbus-tcp", PlcFaultAction.GARBLE_REPLY),
                ("opcua", PlcFaultAction.DROP_REPLY),
                ("opcua", PlcFaultAction.GARBLE_REPLY),
                ("modbus-rtu", PlcFaultAction.DROP_REPLY),
                ("can-virtual", PlcFaultAction.DROP_REPLY),
                ("can-virtual", PlcFaultAction.GARBLE_REPLY),
            )
        ),
    ],
    indirect=["cell"],
    ids=lambda value: value if isinstance(value, str) else value.name.lower(),
)
def test_f25_a_movement_whose_answer_is_lost_is_unproved_and_begun_once(cell, how):
    cell.simulator.faults.add(PlcFault(how, match="write_command MOVE_LINEAR"))
    with cell.connect(timeout_s=TIMEOUT_S) as controller:
        try:
            lift(controller)
        except (OutcomeUnknownError, RemoteProtocolError):
            (request,) = cell.open_requests
            assert "MOVE_LINEAR" in request
    assert cell.simulator.faults.fired
    assert cell.commands.count("MOVE_LINEAR") == 1
    assert cell.movements_started <= 1
    # The client that lost the answer still owned the mailbox.
    cell.clock.advance(OWNER_SILENCE_S)
    with cell.connect() as controller:
        for finding in recover(controller).left:
            assert finding.verdict is Verdict.LOOK
            with pytest.raises(OutcomeUnknownError):
                lift(controller)
            controller.resolver.settle(finding)
        before = cell.movements_started
        lift(controller)
        assert cell.movements_started == before + 1


@pytest.mark.fault("F26")
@pytest.mark.parametrize(
    "first", [0, *(pytest.param(n, marks=pytest.mark.soak) for n in range(1, 8))]
)
def test_f26_whichever_answer_of_a_movement_is_lost_it_is_begun_once(first):
    """In process and in simulated time: one run for every eighth answer, until none is lost."""
    for lost in range(first, 200, 8):
        with served("sim", SoftMotionSimulator(seed=7)) as cell:
            cell.simulator.faults.add(PlcFault(PlcFaultAction.DROP_REPLY, on_exchange=lost))
            try:
                with cell.connect(timeout_s=TIMEOUT_S) as controller:
                    lift(controller)
            except RobolinkError:
                pass
            assert cell.commands.count("MOVE_LINEAR") <= 1, f"answer {lost}"
            assert cell.movements_started <= 1, f"answer {lost}"
            if cell.simulator.faults.pending:
                break
    else:
        raise AssertionError("a movement of 200 answers")
    assert lost > 10


@pytest.mark.fault("F27")
@only("modbus-rtu", "can-virtual")
def test_f27_a_block_that_reaches_the_plc_twice_is_carried_out_once(cell):
    with closing(open_mailbox_link(cell.url)) as link:
        client = MailboxClient(link)
        client.take()
        command = client.command(Opcode.WRITE_TOOL, SLOT, pose=(1.0, 2.0, 3.0, 0.0, 0.0, 0.0))
        for _ in range(3):
            client.write(command)
            client.acknowledged(command)
            assert client.slot(SLOT).counter == 1
    assert cell.commands == ["WRITE_TOOL"] * 3
    assert cell.slot_changes(SLOT) == 1


@pytest.mark.fault("F28", "F32")
@pytest.mark.parametrize(
    "at", [1, *(pytest.param(at, marks=pytest.mark.soak) for at in (8, 32, 61)), 63]
)
def test_f28_f32_a_block_whose_rest_comes_late_is_carried_out_whole_and_once(at):
    with served("modbus-tcp", SoftMotionSimulator(seed=7)) as cell:
        with cell.connect() as controller:
            tear = PlcFault(
                PlcFaultAction.TEAR_WRITE, match="WRITE_TOOL", position=at, seconds=0.05
            )
            cell.simulator.faults.add(tear)
            controller.tools.write(SLOT, NEW, expected=None)
            assert cell.simulator.faults.fired == [tear]
            assert controller.tools.same(controller.tools.read(SLOT), NEW)
        assert cell.slot_changes(SLOT) == 1


@pytest.mark.fault("F28", "F32")
@only("modbus-tcp", "can-virtual")
def test_f28_f32_a_block_whose_rest_never_comes_triggers_nothing(cell):
    with closing(open_mailbox_link(cell.url)) as link:
        client = MailboxClient(link)
        client.take()
        pose = (1.0, 2.0, 3.0, 0.0, 0.0, 0.0)
        whole = list(encode_command(client.command(Opcode.WRITE_TOOL, SLOT, pose=pose)))
        begun = [whole[:cut] + [0] * (64 - cut) for cut in (1, 4, 32, 62, 63)]
        # Both ends, operands and owner are the new one's; its pose is still the earlier one.
        stale = whole[:8] + [0] * 48 + whole[56:]
        for block in (*begun, stale, stale[:20] + whole[20:]):
            link.write_command(block)
            client.wait(0.03)
            assert client.slot(SLOT).counter == 0
        link.write_command(whole)
        client.wait(0.03)
        assert client.slot(SLOT).counter == 1


@pytest.mark.fault("F29")
@only("modbus-tcp")
def test_f29_behind_the_highest_number_comes_1_and_0_is_never_sent(cell):
    with closing(open_mailbox_link(cell.url)) as link:
        client = MailboxClient(link)
        client.sequence = HIGHEST - 2
        client.take()
        client.done(Opcode.OWNERSHIP, 0)
        assert client.now().ack_head == HIGHEST
    with cell.connect() as controller:
        controller.tools.write(SLOT, NEW, expected=None)
        assert controller.tools.same(controller.tools.read(SLOT), NEW)
    arrived = [text for _, way, text in cell.simulator.log if way == ">"]
    numbers = [int(text.split()[-1]) for text in arrived if text.startswith("write_command")]
    assert numbers[:4] == [HIGHEST - 1, HIGHEST, 1, 2]
    assert 0 not in numbers
    assert cell.slot_changes(SLOT) == 1


@pytest.mark.fault("F31")
@pytest.mark.parametrize(
    "match", [pytest.param("read_response", marks=pytest.mark.soak), "read_slot"]
)
def test_f31_a_torn_answer_is_read_again_and_never_half_believed(match):
    with served("modbus-tcp", SoftMotionSimulator(seed=7)) as cell:
        with cell.connect() as controller:
            controller.tools.write(SLOT, NEW, expected=None)
            torn = [PlcFault(PlcFaultAction.TEAR_REPLY, on_exchange=n, match=match) for n in (0, 2)]
            for fault in torn:
                cell.simulator.faults.add(fault)
            for _ in range(5):
                assert controller.tools.same(controller.tools.read(SLOT), NEW)
                assert controller.tools.selected() == 1
                controller.status()
            assert cell.simulator.faults.fired == torn
