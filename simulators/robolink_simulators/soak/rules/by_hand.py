"""What somebody does at the pendant while robolink asks a question stays, and is noticed.

Only then: what a hand does between a look and the request that follows it can be seen by nobody.
"""

from robolink.model import ToolOffset
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

    def begin(self) -> None:
        """Begin a deed: whoever sets out to it sees what is there."""
        self._typed.clear()

    def typed(self, tool: int, offset: ToolOffset) -> None:
        """Note what was typed."""
        self._typed[tool] = offset

    def leaving(self, sent: SentRequest, state: MachineState) -> None:
        """Check a request that is about to leave."""
        if sent.kind is SentKind.WRITE and sent.tool in self._typed:
            by_hand, holds = self._typed[sent.tool], state.tools.get(sent.tool)
            self._on.hold(
                "ByHandStays",
                not self._on.plant.same(by_hand, holds),
                f"{sent.text} leaves, and tool {sent.tool} holds {by_hand}, typed by hand",
            )

    def at_rest(self, state: MachineState) -> None:
        """Check that what was typed by hand is there still, when the people have recovered."""
        for tool, offset in self._typed.items():
            self._on.hold(
                "ByHandStays",
                self._on.plant.same(offset, state.tools.get(tool)),
                f"tool {tool} holds {state.tools.get(tool)}, and {offset} was typed by hand",
            )
