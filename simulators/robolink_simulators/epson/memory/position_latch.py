"""The latch of a robot's position by an input: SetLatch, LatchEnable (docs/reference/spel.md 7.1).

Hardware does it: the position is that of the edge itself, however seldom a program looks.
"""

from typing import Final, NamedTuple

from robolink_simulators.epson.arm.arm import Arm
from robolink_simulators.epson.arm.joints import Joints
from robolink_simulators.epson.memory.input_bits import InputBits, first_between
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal

PORTS: Final = range(24, 28)
"""Inputs that can trigger a latch (documented)."""

MOST_TIMES: Final = 4
_SAMPLE_NS: Final = 1_000_000
"""A pulse of an input at the tip that is shorter is not seen (assumed)."""


class LatchSetting(NamedTuple):
    """What SetLatch has set.

    Attributes:
        port: The input.
        rising: Whether the edge that counts is the one to On.
        times: How many positions are taken.
    """

    port: int
    rising: bool
    times: int


class PositionLatch:
    """Takes the joints of an arm at edges of an input.

    Args:
        arm: Whose joints.

    Attributes:
        taken: The joints at each edge since it was enabled.
        enabled: Whether it looks out for edges.
    """

    def __init__(self, arm: Arm) -> None:
        self.taken = list[Joints]()
        self.enabled = False
        self._arm = arm
        self._inputs: InputBits | None = None
        self._setting: LatchSetting | None = None
        self._level = False

    def listen(self, inputs: InputBits) -> None:
        """Look at the inputs of a controller."""
        self._inputs = inputs
        inputs.listeners.append(self._switched)

    @property
    def complete(self) -> bool:
        """Whether as many positions are taken as were asked for (LatchState)."""
        return self._setting is not None and len(self.taken) >= self._setting.times

    def set(self, port: int, *, rising: bool, times: int) -> None:
        """Say which edges of which input count, and how many.

        Raises:
            Refusal: The input cannot trigger a latch, or there are not so many positions.
        """
        if port not in PORTS:
            raise SpelRefusal(RefusalKind.IO_BIT, f"Input {port} triggers no latch")
        if not 1 <= times <= MOST_TIMES:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"{times} positions")
        self._setting = LatchSetting(port, rising, times)

    def enable(self, on: bool) -> None:
        """Begin to look out, with no position taken, or cease; what was taken is kept (assumed).

        Raises:
            Refusal: It was not said for what (documented that SetLatch comes before it).
        """
        if on:
            if self._setting is None or self._inputs is None:
                raise SpelRefusal(RefusalKind.LATCH_UNSET, "SetLatch has not been carried out")
            self.taken = []
            self._level = self._inputs.get(self._setting.port)
        self.enabled = on
        self._arm.followed = self._follow if on else None

    def forget(self) -> None:
        """Forget all, as power-off does (assumed)."""
        self.enabled, self._setting, self.taken = False, None, []
        self._arm.followed = None

    def position(self, number: int) -> Joints:
        """Return where the arm was at an edge, 1 for the first.

        Raises:
            Refusal: There was none (the number of that error is assumed).
        """
        if not 1 <= number <= MOST_TIMES:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"There is no latch {number}")
        if number > len(self.taken):
            raise SpelRefusal(RefusalKind.POINT_UNDEFINED, f"Position {number} is not latched")
        return self.taken[number - 1]

    def _switched(self, number: int, on: bool) -> None:
        """An input was switched by hand."""
        if self.enabled and self._setting is not None and number == self._setting.port:
            self._meet(on, self._arm.joints)

    def _meet(self, on: bool, joints: Joints) -> None:
        edge, self._level = on != self._level, on
        setting = self._setting
        if edge and setting is not None and on == setting.rising and not self.complete:
            self.taken.append(joints)

    def _follow(self, since_ns: int, until_ns: int) -> None:
        """Look at what an input at the tip has shown on the way."""
        setting, inputs = self._setting, self._inputs
        if setting is None or inputs is None or not inputs.follows(setting.port):
            return

        def changed(instant_ns: int) -> bool:
            with inputs.as_at(instant_ns):
                return inputs.get(setting.port) != self._level

        before_ns = since_ns
        while before_ns < until_ns and not self.complete:
            after_ns = min(before_ns + _SAMPLE_NS, until_ns)
            if changed(after_ns):
                edge_ns = first_between(before_ns, after_ns, changed)
                self._meet(not self._level, self._arm.position_at(edge_ns))
            before_ns = after_ns
