"""A Structured Text program behind the same hosts as the modelled one."""

from contextlib import closing

import pytest
from robolink_cli import main
from robolink_simulators.hosting.fieldbus.canopen_node import CanPlace, serve_canopen
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_rtu, serve_modbus_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.structured_text import StructuredTextError

from robolink.protocols.mailbox import Opcode
from robolink.protocols.mailbox.exports import program_texts
from robolink.transport import open_mailbox_link
from tests.unit._mailbox_client import MailboxClient, linked
from tests.unit.structured_text._behaviours import of_program


def hosts(simulator, bus):
    if bus == "modbus-tcp":
        return serve_modbus_tcp(simulator)
    if bus == "modbus-rtu":
        return serve_modbus_rtu(simulator)
    return serve_canopen(simulator, CanPlace("virtual", "program-of-a-plc"))


@pytest.mark.soak
@pytest.mark.parametrize("bus", ["modbus-tcp", "modbus-rtu", "can"])
def test_a_client_commands_the_program_on_each_bus(bus):
    simulator = SoftMotionSimulator(make_plc=of_program())
    with (
        hosts(simulator, bus) as host,
        closing(open_mailbox_link(host.url, timeout_s=5.0)) as link,
    ):
        client = MailboxClient(link)
        client.take()
        pose = (1.5, 0.0, 0.0, 0.0, 0.0, 0.0)
        client.done(Opcode.WRITE_TOOL, 5, pose=pose, name="needle")
        assert client.slot(5).tool[0] == 1.5
        assert client.done(Opcode.SELECT_TOOL, 5).tool_slot == 5
        client.end_of(client.move(z=-1.0).ack_head)
    assert simulator.plc.group.movements_started == 1


def test_a_folder_without_a_program_is_told(tmp_path, capsys):
    argv = ["sim", "softmotion", "--modbus-tcp", "127.0.0.1:0", "--program", str(tmp_path)]
    assert main.run(argv) == 2
    assert "robolink_core.st" in capsys.readouterr().err


def test_a_program_that_leaves_the_subset_is_told_with_its_place(tmp_path, capsys):
    for name, text in program_texts().items():
        (tmp_path / name).write_text(text)
    core = tmp_path / "robolink_core.st"
    core.write_text(core.read_text().replace("rejected := rejected + 1;", "rejected := raw;"))
    argv = ["sim", "softmotion", "--modbus-tcp", "127.0.0.1:0", "--program", str(tmp_path)]
    assert main.run(argv) == 2
    told = capsys.readouterr().err
    line = 1 + core.read_text()[: core.read_text().index("rejected := raw;")].count("\n")
    assert f"robolink_core.st, line {line}, column" in told
    assert issubclass(StructuredTextError, ValueError)


def test_the_machine_s_program_is_told_of_a_changed_tool_and_keeps_that():
    simulator = SoftMotionSimulator(make_plc=of_program())
    client = linked(simulator)
    simulator.panel.take_change_back()
    client.take()
    assert not simulator.panel.tool_changed
    client.done(Opcode.WRITE_TOOL, 5, pose=(1.5, 0.0, 0.0, 0.0, 0.0, 0.0), name="needle")
    assert simulator.panel.tool_changed
    assert simulator.panel.owned
    simulator.panel.restart()
    client.wait(0.05)
    assert simulator.panel.tool_changed
    assert not simulator.panel.owned
