"""The contract of every controller, compared with the machine after every event and call."""

import math
import weakref
from typing import Final

from robolink_simulators.cell.frames import Frame, axis_and_angle, product, transposed
from robolink_simulators.epson.arm.kinematics import frame_of

from robolink.controllers.controller_core import ControllerCore
from robolink.model import Motion, Pose, ToolOffset, ToolReceipt, WorkBox
from tests.soak.adversary.computer import VirtualProcess
from tests.soak.adversary.plant.machine import MachineState, SentKind, SentRequest
from tests.soak.adversary.rules.grounds import Grounds

_NEAR_MM: Final = 0.05
_NEAR_DEG: Final = 0.05
"""Tolerance for three decimals, the noise of a measured position, and an arm's resolution."""

_MOVED_MM: Final = 1e-6


class PlaceRules:
    """Compares poses and targets with the place of the machine's tip.

    Args:
        grounds: The data of the rules.
    """

    def __init__(self, grounds: Grounds) -> None:
        self._on = grounds
        self._before: dict[int, Frame | None] = {}
        # Not the movement itself: it holds the controller of a process that may be killed.
        self._sent: dict[int, tuple[weakref.ref[Motion], ToolOffset | None]] = {}

    def begin(self) -> None:
        """Begin an hour."""
        self._before.clear()
        self._sent.clear()

    def begins(self, process: VirtualProcess) -> None:
        """Note the tip's place when a process begins a call; nothing while it moves."""
        self._before[process.number] = self._standing()

    def begun(
        self, process: VirtualProcess, motion: Motion, target: Pose, box: WorkBox
    ) -> tuple[bool, str]:
        """Return whether a movement goes to its target, in its box; and the observation."""
        self._sent[process.number] = weakref.ref(motion), self._value_of(target.tool)
        limits = (
            (box.x_min_mm, target.x_mm, box.x_max_mm),
            (box.y_min_mm, target.y_mm, box.y_max_mm),
            (box.z_min_mm, target.z_mm, box.z_max_mm),
        )
        inside = all(low <= value <= high for low, value, high in limits)
        return (
            inside and motion.target == target,
            f"a movement goes to {motion.target}, sent to {target}, in {box}",
        )

    def arrived(self, process: VirtualProcess, motion: Motion) -> tuple[bool, str]:
        """Return whether a movement that arrived is at its target; and the observation."""
        tip, target = self._standing(), motion.target
        sent, value = self._sent.get(process.number, (None, None))
        if sent is None or sent() is not motion or tip is None:
            return True, ""  # one that ends at an input ends somewhere on its way
        if target.tool != self._on.plant.state().selected or value != self._value_of(target.tool):
            return True, ""  # somebody has selected another one meanwhile, or typed its value
        return _alike(tip, frame_of(target)), f"it arrived at {tip}, sent to {target}"

    def read(self, process: VirtualProcess, pose: Pose) -> tuple[bool, str]:
        """Return whether a pose that was read is that of the tip; and the observation."""
        before, now = self._before.get(process.number), self._standing()
        if before is None or now is None or math.dist(before.shift_mm, now.shift_mm) > _MOVED_MM:
            return True, ""  # it was somewhere on the way
        return _alike(now, frame_of(pose)), f"{pose} was read, the tip is at {now}"

    def _value_of(self, tool: int | None) -> ToolOffset | None:
        return None if tool is None else self._on.plant.state().tools.get(tool)

    def _standing(self) -> Frame | None:
        return None if self._on.plant.moving else self._on.plant.tip()


def _alike(one: Frame, other: Frame) -> bool:
    turn = product(transposed(one.rotation), other.rotation)
    off_mm, (_, off_deg) = math.dist(one.shift_mm, other.shift_mm), axis_and_angle(turn)
    return off_mm <= _NEAR_MM and abs(off_deg) <= _NEAR_DEG


_STILL_MM: Final = 0.01


class StopRules:
    """Checks requests and movements after a stop.

    Args:
        grounds: The data of the rules.
    """

    def __init__(self, grounds: Grounds) -> None:
        self._on = grounds
        self._rest: Frame | None = None

    def begin(self) -> None:
        """Begin an hour."""
        self._rest = None

    def leaving(self, process: VirtualProcess, sent: SentRequest) -> None:
        """Check that no movement leaves a process in which a stop has begun."""
        if sent.kind is not SentKind.MOVE:
            return
        self._rest = None
        self._on.hold(
            "StillAfterStop",
            not process.held_back,
            f"{sent.text} leaves process {process.number} after a stop has begun in it",
        )

    def acknowledged(self) -> None:
        """Check the machine when a stop is acknowledged; from now on it has stopped there."""
        self._on.hold("AtRestWhenStopped", not self._on.plant.moving, "it still moves")
        if not self._on.plant.calls_back:
            self._rest = self._on.plant.flange()

    def held(self, process: VirtualProcess, controller: ControllerCore, what: str) -> None:
        """Check that a latch is closed in a process in which somebody has stopped."""
        self._on.hold(
            "StillAfterStop",
            controller.latch.closed or not process.held_back,
            f"the latch of process {process.number} is open after {what}",
        )

    def passed(self) -> None:
        """Check, after an event, that a machine acknowledged as stopped is still at its place."""
        if self._rest is None or (self._on.plant.bent and not self._on.plant.numbered):
            return  # a request delayed by the wire looks the same if it has no number
        now = self._on.plant.flange()
        self._on.hold(
            "AtRestWhenStopped",
            now is not None and math.dist(now.shift_mm, self._rest.shift_mm) <= _STILL_MM,
            f"the flange is at {now}, and a stop was acknowledged when it was at {self._rest}",
        )


class SeenStates:
    """The machine's states since each call began, event by event."""

    def __init__(self) -> None:
        self._seen: list[MachineState] = []
        self._since: dict[int, int] = {}

    def note(self, state: MachineState) -> None:
        """Note the present state, if it differs from the last one."""
        if not self._seen or self._seen[-1] != state:
            self._seen.append(state)

    def begin(self, process: VirtualProcess) -> None:
        """Note that a process begins a call now."""
        self._since[process.number] = max(0, len(self._seen) - 1)

    def since(self, process: VirtualProcess) -> list[MachineState]:
        """Return the states since the last call of a process began."""
        return self._seen[self._since.get(process.number, 0) :]

    def forget(self) -> None:
        """Start again."""
        self._seen.clear()
        self._since.clear()


_RULE: Final = "ContractHolds"


class ContractRules:
    """Judges the results of calls; :mod:`tests.soak.adversary.call_watch` supplies them.

    Args:
        grounds: The data of the rules.

    Attributes:
        stops: The promises of a stop.
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
        """Begin an hour; ``previews`` if its line only shows its requests."""
        self._previews = previews
        self._states.forget()
        self._states.note(state)
        self._aims.clear()
        self._asked.clear()
        self.stops.begin()
        self._places.begin()
        self._selects, self._last = False, state

    def left(self) -> None:
        """Check the results of a deed; from here on people act freely."""
        self.passed()
        self._previews = False

    # After every event.

    def leaving(self, process: VirtualProcess, sent: SentRequest) -> None:
        """Check a request that is about to leave: a movement is for the selected tool."""
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
        """Check the changes since the last event: each was asked for."""
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
            and not self._on.from_a_lost_write(tool, state.tools.get(tool))
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
        """Note that a call begins."""
        self.passed()
        self._states.begin(process)
        self._places.begins(process)

    def aims(self, process: VirtualProcess, tool: int | None) -> None:
        """Note that a movement meant for a tool is about to leave."""
        self._aims[process.number] = tool

    def has_read(self, process: VirtualProcess, tool: int, offset: ToolOffset | None) -> None:
        """Check a tool's value that was read."""
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
        """Check the selected tool that was read."""
        held = [state.selected for state in self._since(process)]
        self._promise(tool is None or tool in held, f"tool {tool} was read as selected: {held}")

    def has_written(self, process: VirtualProcess, receipt: ToolReceipt) -> None:
        """Check the receipt of a write: the old value and the stored one."""
        held = [state.tools.get(receipt.tool) for state in self._since(process)]
        held += [self._on.staged[receipt.tool]] if receipt.tool in self._on.staged else []
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
        """Check that a tool that was selected took effect."""
        held = [state.selected for state in self._since(process)]
        self._promise(tool in held, f"tool {tool} was selected, in force were {held}")

    def has_begun(
        self, process: VirtualProcess, motion: Motion, target: Pose, box: WorkBox
    ) -> None:
        """Check the target of a movement that was begun."""
        self._promise(*self._places.begun(process, motion, target, box))

    def has_arrived(self, process: VirtualProcess, motion: Motion) -> None:
        """Check that a movement that arrived is over, at its target."""
        self._promise(not self._on.plant.moving, "a movement arrived, and the arm moves")
        self._promise(*self._places.arrived(process, motion))

    def has_read_pose(self, process: VirtualProcess, pose: Pose) -> None:
        """Check a pose that was read: its tool, and its place."""
        held = [state.selected for state in self._since(process)]
        self._promise(pose.tool in held, f"{pose} names its tool, in force were {held}")
        self._promise(*self._places.read(process, pose))

    def has_read_robot(self, process: VirtualProcess, robot: int) -> None:
        """Check the current robot that was read."""
        held = [state.robot for state in self._since(process)]
        self._promise(robot in held, f"robot {robot} was read, in force were {held}")

    def stopping(self, process: VirtualProcess) -> None:
        """Note that a stop begins."""
        self.passed()
        process.held_back = True

    def has_stopped(
        self, process: VirtualProcess, controller: ControllerCore, *, acknowledged: bool
    ) -> None:
        """Check the latch when a stop has ended, and the machine if it was acknowledged."""
        self.stops.held(process, controller, "stop()")
        if acknowledged:
            self.stops.acknowledged()

    def has_reset(self, process: VirtualProcess, controller: ControllerCore) -> None:
        """Check that clearing an error has opened no latch."""
        self.stops.held(process, controller, "reset_fault()")

    def releasing(self, process: VirtualProcess) -> None:
        """Note that a person releases the stop."""
        process.held_back = False

    def _since(self, process: VirtualProcess) -> list[MachineState]:
        self._states.note(self._on.plant.state())
        return self._states.since(process)

    def _promise(self, kept: bool, sentence: str) -> None:
        # Without a checksum an altered frame looks like the truth.
        self._on.hold(_RULE, kept or self._on.plant.bent, sentence)
