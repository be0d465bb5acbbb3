"""What a test asks of its simulated cell, by the marker ``robolink`` or of a factory."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import ToolOffset

_PROGRAM_EXAMPLE: Final = 'softmotion_factory(program="our-plc")'


@dataclass(frozen=True, slots=True)
class CellRequest:
    """How a simulated cell is to be.

    Attributes:
        robot: Model of an EPSON robot, for example ``C8-C901S``.
        kinematics: Of a PLC, for example ``Kin_Gantry3+Kin_CAxis``.
        seed: Another cell: other tools, another tip; ``None`` for that of the test run.
        password: Of Remote Ethernet.
        options: Habits of the controller by name, as ``robolink sim --option`` has them.
        world: What goes wrong around the robot by name, as ``robolink sim --world`` has them.
        faults: A fault plan: a file, or faults as a file has them, one mapping each.
        speed: Simulated seconds per real one, on a port; 0 lets time pass with requests alone.
        true_tool: Where the tip of tool 1 really is: x, y, z in mm, and u, v, w in degrees.
        map: The map of a PLC with registers of its own.
        program: A folder with the program of a SoftMotion PLC, as ``expert plc export`` writes
            it, changed or not; ``None`` for the modelled one.
    """

    robot: str = "T6-602S"
    kinematics: str = "Kin_Scara3_Z"
    seed: int | None = None
    password: str = ""
    options: Mapping[str, object] | None = None
    world: Mapping[str, object] | None = None
    faults: str | Path | tuple[Mapping[str, object], ...] | list[Mapping[str, object]] = ()
    speed: float | None = None
    true_tool: tuple[float, ...] | None = None
    map: str | Path | None = None
    program: str | Path | None = None

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> "CellRequest":
        """Return what was asked for by name.

        Raises:
            ConfigError: There is no such name, or a true tool of another length.
        """
        names = tuple(field.name for field in fields(cls))
        for name in given:
            if name not in names:
                raise ConfigError(
                    tr("A simulated cell has no parameter {name!r}.", name=name),
                    remedy=tr("These are known: {names}.", names=", ".join(names)),
                )
        request = cls(**given)
        if request.true_tool is not None and len(request.true_tool) not in (3, 6):
            raise ConfigError(
                tr("A true tool has three lengths, and three angles or none."),
                remedy=tr("Give it as {example}.", example="true_tool=(12.4, -3.2, -20.1)"),
            )
        return request

    def require_no_program(self) -> None:
        """Refuse a program for a cell that would pay no heed to it.

        Raises:
            ConfigError: One was asked for.
        """
        if self.program is not None:
            raise ConfigError(
                tr("Only a simulated SoftMotion PLC executes a program."),
                remedy=tr("Give it where that PLC is made: {example}.", example=_PROGRAM_EXAMPLE),
            )

    @property
    def tip(self) -> ToolOffset | None:
        """Where the tip of tool 1 really is; ``None`` for where the seed puts it."""
        return None if self.true_tool is None else ToolOffset(*self.true_tool)

    def texts(self, name: str) -> dict[str, str]:
        """Return options or world as text, as the command line and URLs have them."""
        given: Mapping[str, object] = getattr(self, name) or {}
        return {
            key: str(int(value)) if isinstance(value, bool) else str(value)
            for key, value in given.items()
        }
