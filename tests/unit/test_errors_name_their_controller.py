"""An error that leaves a driver names the controller and the request."""

from dataclasses import replace

import pytest

from robolink.controllers import ControllerCore, SimpleController, ToolTableCore
from robolink.errors import (
    Concerning,
    ConfigError,
    NotReadyError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    StoppedError,
    ToolChangedError,
    TransportTimeoutError,
)
from robolink.model import Capabilities, MotionProfile, Path, Pose, ToolOffset, WorkBox
from robolink.protocols.mailbox import ErrorClass, GroupState, Opcode
from tests.unit._plc_bench import COMMIT_BIT, Bench
from tests.unit.softmotion_driver._cell import Cell

PLC = "plc+modbus-tcp://named:502"
OFFSET = ToolOffset(1.5, -2.25, 3.0, 45.0)


@pytest.fixture
def cell(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    cell = Cell()
    yield cell
    cell.close()


@pytest.fixture
def bench(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    return Bench(COMMIT_BIT, identity=PLC)


def error_of(act, *arguments, **options):
    with pytest.raises(RobolinkError) as caught:
        act(*arguments, **options)
    return caught.value


def named(error):
    return type(error), error.controller, error.request


def test_what_was_named_nearer_to_the_cause_stays():
    nearer = ConfigError("no", controller="a", request="read")
    with pytest.raises(ConfigError), Concerning("b", "write"):
        raise nearer
    assert (nearer.controller, nearer.request) == ("a", "read")
    nameless = ConfigError("no")
    with pytest.raises(ConfigError), Concerning("b", "write"):
        raise nameless
    assert (nameless.controller, nameless.request) == ("b", "write")


def test_a_kind_of_another_package_need_not_name_its_controller():
    class Tools(ToolTableCore):
        """The tools of a kind whose errors say only what happened."""

        def indices(self):
            return (1, 2)

        def same(self, a, b):
            return a == b

        def _stored(self, tool):
            raise RemoteProtocolError(f"tool {tool} makes no sense")

        def _set(self, tool, requested, expected):
            raise AssertionError

        def _request(self, tool, requested):
            return f"tool {tool}"

        def _selected(self):
            return 0

        def _select_request(self, tool):
            return f"select {tool}"

        def _send_selection(self, tool):
            raise AssertionError

    class Arm(ControllerCore):
        """The arm of a kind whose errors say only what happened."""

        exchanges = 0

        def _read_status(self):
            raise TransportTimeoutError("silence")

        def _close_link(self):
            pass

        def facts(self):
            raise RejectedError("no facts")

    link = SimpleController()._driver
    arm = Arm(link, capabilities=Capabilities(), tools=Tools(link))
    assert named(error_of(arm.tools.read, 1)) == (RemoteProtocolError, link.identity, "")
    assert named(error_of(arm.tools.select, 1)) == (
        RemoteProtocolError,
        link.identity,
        "select 1",
    )
    assert named(error_of(arm.status)) == (TransportTimeoutError, link.identity, "")
    assert named(error_of(arm.facts)) == (RejectedError, link.identity, "")


def test_a_plc_with_a_map_is_named(bench):
    with bench.connect() as controller:
        tools = controller.tools
        request = "; ".join(tools.preview_write(1, OFFSET))
        stale = error_of(tools.write, 1, OFFSET, expected=OFFSET)
        assert named(stale) == (ToolChangedError, PLC, request)
        far = error_of(tools.write, 1, ToolOffset(1e6), expected=None)
        assert (far.controller, far.request) == (PLC, "")
        assert named(error_of(controller.reset_fault)) == (RejectedError, PLC, "")
        assert named(error_of(controller.io.read_input, 99)) == (ConfigError, PLC, "")
        controller.latch.close()
        assert named(error_of(tools.write, 1, OFFSET, expected=None)) == (
            StoppedError,
            PLC,
            request,
        )


def test_a_refusal_of_such_a_plc_is_named(bench):
    bench.program.memory.switch(bench.map.commit.error, True)
    with bench.connect() as controller:
        request = "; ".join(controller.tools.preview_write(1, OFFSET))
        refused = error_of(controller.tools.write, 1, OFFSET, expected=None)
    assert named(refused) == (NotReadyError, PLC, request)


def test_a_mailbox_is_named(cell):
    controller = cell.met()
    identity, (group,) = controller.identity, controller.groups
    cell.plc.now = replace(cell.plc.now, group_state=GroupState.DISABLED)
    asleep = error_of(group.require_able, "a trial")
    assert named(asleep) == (NotReadyError, identity, "a trial")
    target = Pose(400, 90, 250, 45, tool=0)
    profile = MotionProfile(Path.STRAIGHT)
    (request,) = group.requests_for(target, profile)
    assert named(error_of(group.move_to, target, profile, box=WorkBox())) == (
        NotReadyError,
        identity,
        request,
    )
    assert named(error_of(controller.tools.write, 99, OFFSET, expected=None))[1] == identity
    cell.link.lose_request("read_slot")
    silent = error_of(controller.tools.read, 3)
    assert named(silent) == (TransportTimeoutError, identity, "")


def test_what_a_mailbox_refuses_is_named_with_its_command(cell):
    controller = cell.met()
    cell.plc.refusals[Opcode.READ_INPUT] = ErrorClass.NO_EDGE
    refused = error_of(controller.io.read_input, 77)
    assert (refused.controller, refused.request) == (controller.identity, "30006 READ_INPUT 77")
