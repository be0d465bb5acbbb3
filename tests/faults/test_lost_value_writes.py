"""A lost answer to an output, a memory bit or a variable: unknown, never sent twice."""

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction

import robolink
from robolink.controllers import EpsonController
from robolink.errors import ConfigError, OutcomeUnknownError
from robolink.model import Marker, MarkerKind, Verdict

WRITES = {
    "SetIO": lambda controller: controller.io.set_output(3, True),
    "SetMemIO": lambda controller: controller.io.set_memory(3, True),
    "SetVariable": lambda controller: controller.variables.write("g_Real", 0.1, "Real"),
}


def epson(controller):
    assert isinstance(controller, EpsonController)
    return controller


@pytest.mark.parametrize("name", WRITES)
@pytest.mark.parametrize("action", [FaultAction.DROP_REPLY, FaultAction.DISCONNECT_BEFORE])
def test_a_lost_answer_is_unknown_blocks_motion_and_is_settled_by_reading(serve, name, action):
    simulator = EpsonSimulator(seed=5, faults=[Fault(action, match=f"${name}")])
    applied = action is FaultAction.DROP_REPLY
    with serve(simulator) as url:
        with robolink.connect(url, timeout_s=0.3) as controller:
            with pytest.raises(OutcomeUnknownError, match="may or may not have run"):
                WRITES[name](controller)
        with robolink.connect(url) as controller:
            with pytest.raises(OutcomeUnknownError, match="did not finish"):
                controller.require_settled("Go")
            (marker,) = controller.outcomes.open_markers()
            assert marker.request.startswith(f"${name}")
            finding = controller.resolver.examine(marker)
            assert finding.verdict is (Verdict.DONE if applied else Verdict.NOT_APPLIED)
            controller.resolver.settle(finding)
            assert controller.outcomes.open_markers() == ()
        sent = [text for _, way, text in simulator.log if way == ">" and text.startswith("$Set")]
        assert len(sent) == 1


@pytest.mark.fault("F59")
def test_a_value_that_is_neither_old_nor_new_is_a_conflict(serve):
    simulator = EpsonSimulator(seed=5, faults=[Fault(FaultAction.DROP_REPLY, match="$SetVar")])
    with serve(simulator) as url:
        with robolink.connect(url, timeout_s=0.3) as controller:
            with pytest.raises(OutcomeUnknownError):
                epson(controller).variables.write("g_Long", 5, "Long")
        simulator.variables.set("g_Long", "9", "Long")
        with robolink.connect(url) as controller:
            (marker,) = controller.outcomes.open_markers()
            finding = controller.resolver.examine(marker)
        assert finding.verdict is Verdict.CONFLICT
        assert "9" in finding.sentence


def test_a_refusal_leaves_no_marker(serve):
    with serve(EpsonSimulator()) as url, robolink.connect(url) as controller:
        with pytest.raises(robolink.errors.RejectedError):
            epson(controller).variables.write("g_unknown", 5, "Long")
        assert controller.outcomes.open_markers() == ()


def test_a_marker_of_something_else_is_left_to_a_person(serve):
    marker = Marker("1", MarkerKind.SET, "$SetAnalog,1", "then", {"item": ["analog", "1"]})
    with serve(EpsonSimulator()) as url, robolink.connect(url) as controller:
        with pytest.raises(ConfigError, match="cannot be read"):
            controller.resolver.examine(marker)
