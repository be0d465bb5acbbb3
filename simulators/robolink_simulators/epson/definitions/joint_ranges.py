"""JRange and Range: how far a program lets each joint go.

Source: docs/reference/spel.md 6.3, 7.2.
"""

from collections.abc import Iterable, Sequence

from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal

Ends = tuple[float, float]


class JointRanges:
    """The ranges of one robot's joints: the model's own until they are narrowed.

    That nothing widens the model's own is assumed.

    Args:
        own: Low and high of each joint as the model is built, in degrees or mm.
        pulses_per_unit: Its encoder pulses per degree or mm.

    Attributes:
        ends: Those in force.
        changes: How often they were changed.
    """

    def __init__(self, own: Iterable[Ends], pulses_per_unit: Sequence[float]) -> None:
        self._own = tuple(own)
        self._scales = pulses_per_unit
        self.ends = self._own
        self.changes = 0

    def pulses(self) -> list[int]:
        """Return low and high of each joint in turn."""
        joints = zip(self.ends, self._scales, strict=True)
        return [round(end * scale) for ends, scale in joints for end in ends]

    def set_pulses(self, joint: int, low: int, high: int) -> None:
        """Narrow one joint, 1 to as many as there are.

        Raises:
            Refusal: It is no range, or one beyond the model's own.
        """
        scale, own = self._scales[joint - 1], self._own[joint - 1]
        lowest, highest = (round(end * scale) for end in own)
        if not lowest <= low < high <= highest:
            raise SpelRefusal(
                RefusalKind.VALUE_OUT_OF_RANGE,
                f"Joint {joint} from {low} to {high}: allowed are {lowest} to {highest}",
            )
        # The pulse nearest to the model's own end stands for that end.
        ends = (
            own[0] if low == lowest else low / scale,
            own[1] if high == highest else high / scale,
        )
        self.ends = (*self.ends[: joint - 1], ends, *self.ends[joint:])
        self.changes += 1

    def to_state(self) -> list[list[float]]:
        """Return what survives power-off, ready for JSON."""
        return [list(ends) for ends in self.ends]

    def restore(self, state: object) -> None:
        """Take over what :meth:`to_state` returned.

        Raises:
            TypeError, ValueError: It is something else.
        """
        if not isinstance(state, list) or len(state) != len(self._own):
            raise ValueError(state)
        self.ends = tuple((float(low), float(high)) for low, high in state)
        self.changes += 1
