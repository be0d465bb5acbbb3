"""What was asked for is what is there, with every digit: judged by what people typed.

The markers and the entries of the driver say what it believed that it was asked for. A driver that
loses a digit before it stores its marker is right by its own record; not by this one.
"""

from collections.abc import Mapping, Sequence

from robolink.model import ToolOffset
from robolink_simulators.soak.people import TOOL, Wish
from robolink_simulators.soak.plant.machine import MachineState
from robolink_simulators.soak.rules.so_far import Grounds

_Values = Mapping[int, ToolOffset | None]


class AskedRules:
    """Compares what the machine holds with what people have typed, hour after hour.

    Args:
        grounds: What the rules rest on.
    """

    def __init__(self, grounds: Grounds) -> None:
        self._on = grounds
        self._before: list[_Values] = []
        self._sure = True

    def begin(self) -> None:
        """Begin an hour."""
        self._sure = True

    def doubt(self) -> None:
        """Note that something happens after which nobody can tell what the last change was."""
        self._sure = False

    def succeeded(self, wish: Wish, state: MachineState) -> None:
        """Check what a deed that ended well has left."""
        for tool, offset in wish.typed:
            self._hold(tool, offset, state, "was typed")
        report = self._on.now.report
        if report is not None:
            (done,) = report.tools
            self._hold(TOOL, done.proposal.offset, state, "was agreed to")
        if wish.undoes and self._before and self._sure:
            for tool, offset in self._before[-1].items():
                self._hold(tool, offset, state, "was there before the last change")

    def left(self, state: MachineState) -> None:
        """Check what a deed has left, however it ended: nothing but what somebody asked for."""
        now, plant = self._on.now, self._on.plant
        for tool in {tool for tool, _ in now.wish.asked}:
            holds, first = state.tools.get(tool), now.first.tools.get(tool)
            others = (*now.wish.asked, *now.typed_by_others)
            asked = [first, *(offset for number, offset in others if number == tool)]
            self._on.hold(
                "AskedValue",
                plant.same(first, holds)
                or tool in plant.touched
                or any(plant.holds(one, holds) for one in asked)
                or self._mistaken(tool, asked, holds),
                f"tool {tool} holds {holds}; asked for were {asked}",
            )

    def _mistaken(
        self, tool: int, asked: Sequence[ToolOffset | None], holds: ToolOffset | None
    ) -> bool:
        """Tell whether the machine took an offset for another one, and the record is open."""
        books = self._on.books
        told = not books.trusted or any(
            m.details.get("tool") == tool or str(tool) in m.details.get("tools", {})
            for m in books.markers()
        )
        return told and any(
            self._on.plant.mistook(one, holds) for one in asked if one is not None and holds
        )

    def at_rest(self, state: MachineState) -> None:
        """Note what the hour has changed, for an undo that comes later."""
        now, plant = self._on.now, self._on.plant
        if (
            not self._sure
            or now.wish.free
            or plant.touched
            or now.crowded
            or not self._on.books.trusted
        ):
            self._before.clear()
            return
        typed = {
            tool: now.first.tools.get(tool)
            for tool in {*now.first.tools, *state.tools}
            if not plant.same(now.first.tools.get(tool), state.tools.get(tool))
        }
        steps: list[_Values] = [typed] if typed else []
        if now.wish.meanwhile:  # typed, typed again, and that taken back: three changes
            steps += [dict(now.wish.typed), dict(now.wish.meanwhile)]
        self._before += steps

    def _hold(self, tool: int, asked: ToolOffset | None, state: MachineState, what: str) -> None:
        holds = state.tools.get(tool)
        others = {number for number, _ in self._on.now.typed_by_others}
        self._on.hold(
            "AskedValue",
            tool in self._on.plant.touched | others or self._on.plant.holds(asked, holds),
            f"tool {tool} holds {holds}, and {asked} {what}",
        )
