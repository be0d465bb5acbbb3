"""What somebody does at the pendant while robolink asks a question stays, and is noticed.

Only then: what a hand does between a look and the request that follows it can be seen by nobody.
What is typed by hand later takes the place of what was typed before; where that is what was there
when the deed began, nobody can tell. A second person who has read a value and then types another
one replaces it on purpose.
"""

from robolink.model import ToolOffset
from robolink_simulators.soak.computer import VirtualProcess
from robolink_simulators.soak.plant.machine import MachineState, SentKind, SentRequest
from robolink_simulators.soak.rules.so_far import Grounds


class HandRules:
    """Looks at what becomes of what was typed by hand.

    Args:
        grounds: What the rules rest on.
    """

    def __init__(self, grounds: Grounds) -> None:
        self._on = grounds
        self._typed: dict[int, ToolOffset] = {}
        self._replacing: dict[int, tuple[VirtualProcess, ToolOffset]] = {}

    def begin(self) -> None:
        """Begin a deed: whoever sets out to it sees what is there."""
        self._typed.clear()
        self._replacing.clear()

    def typed(self, tool: int, offset: ToolOffset) -> None:
        """Note what was typed, unless whoever is at work saw the same when they began."""
        if self._on.plant.same(offset, self._on.now.before.tools.get(tool)):
            self._typed.pop(tool, None)
            return
        self._typed[tool] = offset
        self._replacing.pop(tool, None)

    def replaces(self, process: VirtualProcess, tool: int, offset: ToolOffset) -> None:
        """Note that somebody has read what a tool holds now, and is about to type another value."""
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
        """Check that what was typed by hand is there still, when the people have recovered."""
        for tool, first in self._typed.items():
            offset, holds = self._on.plant.by_hand.get(tool, first), state.tools.get(tool)
            replaced = self._replacing.get(tool)
            self._on.hold(
                "ByHandStays",
                self._on.plant.same(offset, holds)
                or (replaced is not None and self._on.plant.same(replaced[1], holds)),
                f"tool {tool} holds {holds}, and {offset} was typed by hand",
            )
