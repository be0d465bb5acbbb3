"""Hofs, CalPls and MCordr: where the zero of each joint lies (docs/reference/spel.md 7.2)."""

from collections.abc import Mapping, Sequence
from typing import Final

_UP_FIRST: Final = (0b0100, 0b1011, 0, 0)


def joint_order(axes: int) -> tuple[int, ...]:
    """Return the default of Hordr and MCordr: the joints of each step as bits.

    Of four axes it is documented (docs/reference/spel.md 7.2); that six move at once is assumed.
    """
    return _UP_FIRST if axes == len(_UP_FIRST) else ((1 << axes) - 1, *(0,) * (axes - 1))


class JointOrigins:
    """Pulses between the zero of each encoder and that of its joint, and what they are found by.

    A joint is told to stand at the pulses of its encoder plus its offset (the sign is assumed).
    What it was delivered with counts as right here, and as 0: another offset is one by which the
    joint really stands elsewhere than the controller says.

    Args:
        pulses_per_unit: Encoder pulses per degree or mm of each joint.

    Attributes:
        offsets: Hofs of each joint in pulses.
        reference: CalPls of each joint, ``None`` before it was given.
        order: MCordr: the joints of each step of MCal as bits.
        changes: How often something of it was changed.
    """

    def __init__(self, pulses_per_unit: Sequence[float]) -> None:
        self._scales = tuple(pulses_per_unit)
        self.offsets: tuple[int, ...] = (0,) * len(self._scales)
        self.reference: tuple[int, ...] | None = None
        self.order = joint_order(len(self._scales))
        self.changes = 0

    @property
    def errors(self) -> tuple[float, ...]:
        """How far each joint really stands from where the controller says, in degrees or mm."""
        joints = zip(self.offsets, self._scales, strict=True)
        return tuple(-offset / scale for offset, scale in joints)

    def offset_by(self, offsets: Sequence[int]) -> None:
        """Take other offsets."""
        self.offsets = tuple(offsets)
        self.changes += 1

    def refer_to(self, pulses: Sequence[int]) -> None:
        """Keep the right pulses of the place where joints are calibrated (CalPls)."""
        self.reference = tuple(pulses)
        self.changes += 1

    def move_in(self, order: Sequence[int]) -> None:
        """Keep the order of MCal."""
        self.order = tuple(order)
        self.changes += 1

    def to_state(self) -> dict[str, object]:
        """Return what survives power-off, ready for JSON."""
        reference = None if self.reference is None else list(self.reference)
        return {"offsets": list(self.offsets), "reference": reference, "order": list(self.order)}

    def restore(self, state: object) -> None:
        """Take over what :meth:`to_state` returned.

        Raises:
            KeyError, TypeError, ValueError: It is something else.
        """
        if not isinstance(state, Mapping):
            raise TypeError(state)
        held = {
            name: None if state[name] is None else tuple(map(int, state[name]))
            for name in ("offsets", "reference", "order")
        }
        for name, values in held.items():
            if len(values or self._scales) != len(self._scales):
                raise ValueError(name)
        self.offsets, self.order = held["offsets"] or self.offsets, held["order"] or self.order
        self.reference = held["reference"]
        self.changes += 1
