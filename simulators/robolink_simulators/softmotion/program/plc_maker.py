"""Which program stands behind a mailbox: the modelled one, or one that is executed."""

from pathlib import Path
from typing import TYPE_CHECKING

from robolink_simulators.softmotion.mailbox.plc import Plc

if TYPE_CHECKING:
    from robolink_simulators.softmotion.mailbox.simulator import PlcMaker


def plc_maker(folder: Path | None) -> "PlcMaker":
    """Return what makes the controller of a ``SoftMotionSimulator``.

    The interpreter is loaded only where a program is to be executed.

    Args:
        folder: Holds a program as ``expert plc export`` writes it, changed or not; ``None`` for
            the modelled program.

    Raises:
        ConfigError: A file of the program is missing, or cannot be read.
    """
    if folder is None:
        return Plc
    from robolink_simulators.softmotion.program.structured_plc import program_plc, sources_in

    return program_plc(sources_in(folder))
