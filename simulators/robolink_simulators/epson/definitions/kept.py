"""What one robot keeps over a power cycle besides its tools."""

from collections.abc import Mapping

from robolink_simulators.epson.definitions.arches import ArchTable


class KeptDefinitions:
    """What one robot is told once and keeps over a power cycle, but for its tools.

    Attributes:
        arches: Those of Jump.
    """

    def __init__(self) -> None:
        self.arches = ArchTable()

    @property
    def changes(self) -> int:
        """How often something of it was changed."""
        return self.arches.changes

    def to_state(self) -> dict[str, object]:
        """Return what survives power-off, ready for JSON."""
        return {"arches": self.arches.to_state()}

    def restore(self, state: Mapping[str, object]) -> None:
        """Take over what :meth:`to_state` returned.

        Raises:
            KeyError, TypeError, ValueError: It is something else.
        """
        self.arches.restore(state["arches"])
