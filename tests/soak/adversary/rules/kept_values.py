"""Requested values are stored; earlier values, and values set by hand, stay.

The driver's markers and entries say what it believed was requested. A driver that loses a digit
before it stores its marker is right by its own record; not by :class:`AskedRules`, which judges by
the typed values.

An act at the pendant while robolink asks a question stays, and is noticed. Only then: an act
between a reading and the request after it is invisible to everybody. A later value typed by hand
replaces an earlier one; if it equals the value at the beginning of the deed, nobody can tell. A
second person who has read a value and then types another one replaces it on purpose.
"""

from collections.abc import Mapping, Sequence
from typing import Final

from robolink.errors import OutcomeUnknownError
from robolink.model import ToolOffset
from tests.soak.adversary.computer import VirtualProcess
from tests.soak.adversary.people import TOOL, Wish
from tests.soak.adversary.plant.machine import MachineState, SentKind, SentRequest
from tests.soak.adversary.rules.grounds import Grounds, chain

_Values = Mapping[int, ToolOffset | None]


class AskedRules:
    """Compares the machine's values with the typed ones, hour after hour.

    Args:
        grounds: The data of the rules.
    """

    def __init__(self, grounds: Grounds) -> None:
        self._on = grounds
        self._before: list[_Values] = []
        self._sure = True

    def begin(self) -> None:
        """Begin an hour."""
        self._sure = True

    def doubt(self) -> None:
        """Note an event after which nobody can tell what the last change was."""
        self._sure = False

    def succeeded(self, wish: Wish, state: MachineState) -> None:
        """Check the results of a deed that ended well."""
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
        """Check the results of a deed, however it ended: every value was asked for."""
        now, plant = self._on.now, self._on.plant
        for tool in {tool for tool, _ in now.wish.asked}:
            holds, first = state.tools.get(tool), now.first.tools.get(tool)
            others = (*now.wish.asked, *now.typed_by_others)
            asked = [first, *(offset for number, offset in others if number == tool)]
            self._on.hold(
                "AskedValue",
                plant.same(first, holds)
                or tool in plant.touched
                or self._on.from_a_lost_write(tool, holds)
                or any(plant.holds(one, holds) for one in asked)
                or self._mistaken(tool, asked, holds),
                f"tool {tool} holds {holds}; asked for were {asked}",
            )

    def _mistaken(
        self, tool: int, asked: Sequence[ToolOffset | None], holds: ToolOffset | None
    ) -> bool:
        """Return whether the machine mistook an offset for another one, and the record is open."""
        books = self._on.books
        told = not books.trusted or any(
            m.details.get("tool") == tool or str(tool) in m.details.get("tools", {})
            for m in books.markers()
        )
        return told and any(
            self._on.plant.mistook(one, holds) for one in asked if one is not None and holds
        )

    def at_rest(self, state: MachineState) -> None:
        """Note the changes of the hour, for a later undo."""
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


_AFTER_A_RESET: Final = (
    (0.0, 5.0, 5.0, 5.0, 50.0, 50.0, 50.0),
    (0.0, 5.0, 5.0, 5.0, 20.0, 20.0, 20.0),
)
"""Settings of the machine itself, which the driver also requires before anything moves."""


class BeforeRules:
    """Checks the things that a deed must leave unchanged.

    Args:
        grounds: The data of the rules.
    """

    def __init__(self, grounds: Grounds) -> None:
        self._on = grounds

    def leaving(self, process: VirtualProcess, sent: SentRequest) -> None:
        """Check that no movement leaves while the arm of an unnumbered machine still moves."""
        if sent.kind is SentKind.MOVE and not self._on.plant.numbered:
            self._on.hold(
                "NothingMovesOn",
                not self._on.plant.moving,
                f"{sent.text} leaves process {process.number} while the arm moves",
            )

    def ended(self, process: VirtualProcess, error: BaseException | None) -> None:
        """Check a deed that ended by itself, with a link that answered to the end."""
        if process.cut_off or self._on.plant.calls_back:
            return
        # A person who is told that the end of a movement is unknown looks at the robot.
        told = any(isinstance(one, OutcomeUnknownError) for one in chain(error))
        self._on.hold(
            "NothingMovesOn",
            told or not self._on.plant.moving,
            "nobody is connected, and the arm moves",
        )
        if error is None and self._on.books.trusted and not self._on.now.crowded:
            left = [
                marker.request
                for marker in self._on.books.markers()
                if marker.operation not in self._on.now.old_markers
            ]
            self._on.hold("NothingOutlives", not left, f"it ended well, and {left} is open")

    def left(self, state: MachineState) -> None:
        """Check the results of a deed before anybody acts."""
        plant, before = self._on.plant, self._on.now.before.settings
        robot = self._on.now.before.robot
        self._on.hold("AsBefore", state.robot == robot, f"robot {state.robot}, not {robot}")
        if plant.calls_back or plant.settings_reset:
            return
        self._on.hold(
            "AsBefore",
            state.settings == before
            or bool(self._on.open_selection())
            or not self._on.books.readable(),
            f"power and speeds are {state.settings}, they were {before}, and nothing says so",
        )

    def at_rest(self, state: MachineState) -> None:
        """Check the cell after its people have recovered it: their reset may have changed it."""
        first = self._on.now.first.settings
        if self._on.plant.calls_back or not self._on.books.trusted:
            return
        self._on.hold(
            "AsBefore",
            state.settings == first
            or (self._on.plant.settings_reset and state.settings in _AFTER_A_RESET),
            f"power and speeds are {state.settings}, they were {first}",
        )


class HandRules:
    """Checks that values typed by hand stay.

    Args:
        grounds: The data of the rules.
    """

    def __init__(self, grounds: Grounds) -> None:
        self._on = grounds
        self._typed: dict[int, ToolOffset] = {}
        self._replacing: dict[int, tuple[VirtualProcess, ToolOffset]] = {}

    def begin(self) -> None:
        """Begin a deed: the person who begins it sees the present values."""
        self._typed.clear()
        self._replacing.clear()

    def typed(self, tool: int, offset: ToolOffset) -> None:
        """Note a typed value, unless the person at work saw the same at the beginning."""
        if self._on.plant.same(offset, self._on.now.before.tools.get(tool)):
            self._typed.pop(tool, None)
            return
        self._typed[tool] = offset
        self._replacing.pop(tool, None)

    def replaces(self, process: VirtualProcess, tool: int, offset: ToolOffset) -> None:
        """Note that somebody has read a tool's value and is about to type another."""
        self._replacing[tool] = (process, offset)

    def leaving(self, process: VirtualProcess, sent: SentRequest, state: MachineState) -> None:
        """Check a request that is about to leave a process."""
        if sent.kind is not SentKind.WRITE or sent.tool not in self._typed:
            return
        if sent.tool not in self._replacing or self._replacing[sent.tool][0] is not process:
            by_hand, holds = self._typed[sent.tool], state.tools.get(sent.tool)
            self._on.hold(
                "ByHandStays",
                not self._on.plant.same(by_hand, holds),
                f"{sent.text} leaves, and tool {sent.tool} holds {by_hand}, typed by hand",
            )

    def at_rest(self, state: MachineState) -> None:
        """Check that values typed by hand are still there when the people have recovered."""
        for tool, first in self._typed.items():
            offset, holds = self._on.plant.by_hand.get(tool, first), state.tools.get(tool)
            replaced = self._replacing.get(tool)
            self._on.hold(
                "ByHandStays",
                self._on.plant.same(offset, holds)
                or (replaced is not None and self._on.plant.same(replaced[1], holds)),
                f"tool {tool} holds {holds}, and {offset} was typed by hand",
            )
