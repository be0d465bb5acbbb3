"""The contract of every controller, held to the machine: after every event, call, and at rest."""

from typing import Final

from robolink.controllers.controller_core import ControllerCore
from robolink.model import Motion, Pose, ToolOffset, ToolReceipt, WorkBox
from robolink_simulators.soak.computer import VirtualProcess
from robolink_simulators.soak.plant.machine import MachineState, SentKind, SentRequest
from robolink_simulators.soak.rules.places import PlaceRules
from robolink_simulators.soak.rules.so_far import Grounds
from robolink_simulators.soak.rules.stops import StopRules
from robolink_simulators.soak.watching import SeenStates

_RULE: Final = "ContractHolds"


class ContractRules:
    """Implements :class:`robolink_simulators.soak.watching.Promises`.

    Args:
        grounds: What the rules rest on.

    Attributes:
        stops: What a stop promises.
    """

    def __init__(self, grounds: Grounds) -> None:
        self._on = grounds
        self.stops, self._places = StopRules(grounds), PlaceRules(grounds)
        self._states = SeenStates()
        self._aims: dict[int, int | None] = {}
        self._asked: set[int] = set()
        self._selects = False
        self._last: MachineState | None = None
        self._previews = False

    def begin(self, state: MachineState, *, previews: bool) -> None:
        """Begin an hour; ``previews`` where its line only shows what it would send."""
        self._previews = previews
        self._states.forget()
        self._states.note(state)
        self._aims.clear()
        self._asked.clear()
        self.stops.begin()
        self._places.begin()
        self._selects, self._last = False, state

    def left(self) -> None:
        """Check what a deed has left; what people do from here on, they do."""
        self.passed()
        self._previews = False

    # After every event.

    def leaving(self, process: VirtualProcess, sent: SentRequest) -> None:
        """Check a request that is about to leave: a movement is for the tool in force."""
        self.passed()
        self.stops.leaving(process, sent)
        if self._previews:
            only_read = sent.kind in (SentKind.OTHER, SentKind.STOP)
            self._on.hold(_RULE, only_read, f"{sent.text} leaves, and was only to be shown")
        if sent.kind is SentKind.WRITE and sent.tool is not None:
            self._asked.add(sent.tool)
        self._selects |= sent.kind is SentKind.SELECT
        if sent.kind is not SentKind.MOVE or self._on.plant.moved_itself:
            return
        aim, selected = self._aims.get(process.number), self._on.plant.state().selected
        self._on.hold(
            "MovesInItsTool",
            aim is None or aim == selected,
            f"{sent.text} leaves, meant for tool {aim}, and tool {selected} is in force",
        )

    def passed(self) -> None:
        """Check what has changed since the last event: nothing that nobody asked for."""
        state, last = self._on.plant.state(), self._last
        self.stops.passed()
        self._states.note(state)
        self._last = state
        if last is None or state == last or self._on.plant.calls_back:
            return
        changed = {
            tool
            for tool in {*state.tools, *last.tools}
            if state.tools.get(tool) != last.tools.get(tool)
        }
        self._on.hold(
            _RULE,
            changed <= self._asked | self._on.plant.touched,
            f"tools {sorted(changed)} changed, written were {sorted(self._asked)}",
        )
        self._on.hold(
            _RULE,
            state.selected == last.selected
            or self._selects
            or self._on.plant.moved_itself
            or state.selected in self._on.now.chosen_by_hand,
            f"tool {state.selected} is in force in place of {last.selected}, and nobody chose it",
        )
        self._on.hold(
            _RULE,
            state.robot == last.robot,
            f"robot {state.robot} is in force in place of {last.robot}, and nobody chose it",
        )

    # After every call.

    def begins(self, process: VirtualProcess) -> None:
        """A call begins."""
        self.passed()
        self._states.begin(process)
        self._places.begins(process)

    def aims(self, process: VirtualProcess, tool: int | None) -> None:
        """A movement is about to leave that is meant for a tool."""
        self._aims[process.number] = tool

    def has_read(self, process: VirtualProcess, tool: int, offset: ToolOffset | None) -> None:
        """Check what was read of a tool."""
        if tool == 0:
            self._promise(offset == ToolOffset(), "tool 0 reads as zeros")
            return
        held = [state.tools.get(tool) for state in self._since(process)]
        held.append(self._on.plant.shown(tool))
        self._promise(
            any(self._on.plant.same(one, offset) for one in held),
            f"tool {tool} was read as {offset}, it held {held}",
        )

    def has_read_selection(self, process: VirtualProcess, tool: int | None) -> None:
        """Check which tool was read to be in force."""
        held = [state.selected for state in self._since(process)]
        self._promise(tool is None or tool in held, f"tool {tool} was read as selected: {held}")

    def has_written(self, process: VirtualProcess, receipt: ToolReceipt) -> None:
        """Check the receipt of a write: what was there, and what is there."""
        held = [state.tools.get(receipt.tool) for state in self._since(process)]
        for what, value in (("before", receipt.before), ("now", receipt.read_back)):
            self._promise(
                any(self._on.plant.same(one, value) for one in held),
                f"tool {receipt.tool} is said to have held {value} {what}, it held {held}",
            )
        self._promise(
            self._on.plant.same(receipt.read_back, receipt.requested),
            f"{receipt} is returned, and another value was read back",
        )

    def has_selected(self, process: VirtualProcess, tool: int) -> None:
        """Check that a tool that was selected was in force."""
        held = [state.selected for state in self._since(process)]
        self._promise(tool in held, f"tool {tool} was selected, in force were {held}")

    def has_begun(
        self, process: VirtualProcess, motion: Motion, target: Pose, box: WorkBox
    ) -> None:
        """Check where a movement goes that was begun."""
        self._promise(*self._places.begun(process, motion, target, box))

    def has_arrived(self, process: VirtualProcess, motion: Motion) -> None:
        """Check that a movement that arrived is over, where it was sent."""
        self._promise(not self._on.plant.moving, "a movement arrived, and the arm moves")
        self._promise(*self._places.arrived(process, motion))

    def has_read_pose(self, process: VirtualProcess, pose: Pose) -> None:
        """Check a pose that was read: whose tip it is, and where that is."""
        held = [state.selected for state in self._since(process)]
        self._promise(pose.tool in held, f"{pose} names its tool, in force were {held}")
        self._promise(*self._places.read(process, pose))

    def has_read_robot(self, process: VirtualProcess, robot: int) -> None:
        """Check which robot was read to be in force."""
        held = [state.robot for state in self._since(process)]
        self._promise(robot in held, f"robot {robot} was read, in force were {held}")

    def stopping(self, process: VirtualProcess) -> None:
        """A stop begins."""
        self.passed()
        process.held_back = True

    def has_stopped(
        self, process: VirtualProcess, controller: ControllerCore, *, acknowledged: bool
    ) -> None:
        """Check the latch when a stop has ended, and the machine where it was acknowledged."""
        self.stops.held(process, controller, "stop()")
        if acknowledged:
            self.stops.acknowledged()

    def has_reset(self, process: VirtualProcess, controller: ControllerCore) -> None:
        """Check that clearing an error has opened no latch."""
        self.stops.held(process, controller, "reset_fault()")

    def releasing(self, process: VirtualProcess) -> None:
        """A person lets things move again."""
        process.held_back = False

    def _since(self, process: VirtualProcess) -> list[MachineState]:
        self._states.note(self._on.plant.state())
        return self._states.since(process)

    def _promise(self, kept: bool, sentence: str) -> None:
        # What a bent frame tells cannot be told apart from the truth where it has no checksum.
        self._on.hold(_RULE, kept or self._on.plant.bent, sentence)
