"""Which port, file or window a number stands for (docs/reference/spel.md 17, 18)."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from robolink_simulators.epson.spel.file_folder import FileFolder
from robolink_simulators.epson.spel.tasks.channels.open_files import FILE_NUMBERS, OpenFiles
from robolink_simulators.epson.spel.tasks.channels.operator_window import (
    WINDOW_NUMBERS,
    OperatorWindow,
)
from robolink_simulators.epson.spel.tasks.channels.ports import Ports

if TYPE_CHECKING:
    from robolink_simulators.epson.spel.tasks.task import SpelTask


class NumberedChannels:
    """What Print #, Input # and their kin reach.

    Args:
        ports: The ports of the controller.
        folder: Where its files lie.
        show: Shows a text to a person.
        keeps_ports: Whether the ports of a task that ends stay open.

    Attributes:
        ports: The ports of the controller.
        files: The files that are open.
        window: Where a person answers Input.
    """

    def __init__(
        self, ports: Ports, folder: FileFolder, show: Callable[[str], None], *, keeps_ports: bool
    ) -> None:
        self.ports = ports
        self.files = OpenFiles(folder)
        self.window = OperatorWindow(show)
        self._keeps_ports = keeps_ports

    def of(self, number: int) -> Ports | OpenFiles | OperatorWindow:
        """Return what a number belongs to; a number of nothing is a port that there is not."""
        if number in WINDOW_NUMBERS:
            return self.window
        return self.files if number in FILE_NUMBERS else self.ports

    def close_of(self, task: "SpelTask") -> None:
        """Close what a task that is over had open."""
        self.files.close_of(task)
        if not self._keeps_ports:
            self.ports.close_of(task)

    def close_all(self) -> None:
        """Close everything."""
        self.files.close_all()
        self.ports.close_all()
