"""The home of a cell: the one computer where its journal is, and where alone it is changed.

A cell file names it; the process notes it by the address of the controller, beside the place of the
journal. Whatever is to be recorded of a cell asks :func:`require_home` first.

Two names mean one computer only if they are the same to the letter, capitals aside. ``PC7`` and
``pc7.plant.local`` do not: two plants may each have a PC7, and a wrong yes would let both write. A
wrong no is told, with the name to write.
"""

from collections.abc import Mapping
from typing import Final, NamedTuple

from robolink.errors import NotAtHomeError
from robolink.messages import tr


class CellHome(NamedTuple):
    """Which computer is the home of a cell.

    Attributes:
        cell: The cell's name.
        computer: Name of the computer, as its system tells it; empty where no file names one.
    """

    cell: str
    computer: str

    @property
    def is_here(self) -> bool:
        """Whether it is this computer, as far as the cell file says."""
        here = this_computer()
        same = bool(here) and computer_key(here) == computer_key(self.computer)
        return same or not self.computer

    def refusal(self, address: str = "") -> NotAtHomeError | None:
        """Return the error of a change that is tried here; ``None`` where this is the home.

        Args:
            address: How the controller is reached.
        """
        if self.is_here:
            return None
        here = this_computer()
        what = tr(
            "The home of {cell} is {home}, and this computer is {here}.",
            cell=self.cell,
            home=self.computer,
            here=here or tr("without a name"),
        )
        if here and _first_label(here) == _first_label(self.computer):
            remedy = tr(
                'Nothing was sent. If that is this computer, write home = "{here}" in the cell '
                "file: the whole name, as its system tells it.",
                here=here,
            )
        else:
            remedy = tr(
                "Nothing was sent. Run it on {home}. If the home has changed: 'robolink journal "
                "move' there, then correct 'home' in the cell file.",
                home=self.computer,
            )
        return NotAtHomeError(what, remedy=remedy, controller=address)

    def require_here(self, address: str = "") -> None:
        """Refuse a change that is tried on another computer.

        Args:
            address: How the controller is reached.

        Raises:
            NotAtHomeError: This computer is not the home of the cell.
        """
        error = self.refusal(address)
        if error is not None:
            raise error


_homes: Final[dict[str, CellHome]] = {}
"""Homes that the cell files name for this process, by the address of the controller."""


def this_computer() -> str:
    """Return the name of this computer as its system tells it; empty where it has none."""
    import platform  # no look needs it

    return platform.node()


def computer_key(name: str) -> str:
    """Return what two names have in common that mean one computer.

    Example:
        >>> from robolink.journal import computer_key
        >>> computer_key("PC7") == computer_key("pc7"), computer_key("PC7.plant.local.")
        (True, 'pc7.plant.local')
    """
    return name.rstrip(".").casefold()


def name_homes(homes: Mapping[str, CellHome], *, afresh: bool = False) -> None:
    """Note the homes of cells, from now on in this process.

    Args:
        homes: Homes by the address of a controller.
        afresh: Whether what was named before is forgotten.
    """
    if afresh:
        _homes.clear()
    _homes.update(homes)


def not_at_home(address: str) -> NotAtHomeError | None:
    """Return the error of a change that is tried elsewhere; ``None`` where it may be made here.

    Args:
        address: How the controller is reached.
    """
    home = _homes.get(address)
    return None if home is None else home.refusal(address)


def require_home(address: str) -> None:
    """Refuse to change a cell, or to record anything of it, on another computer than its home.

    Args:
        address: How the controller is reached.

    Raises:
        NotAtHomeError: This computer is not the home of that cell.

    Example:
        >>> from robolink.errors import NotAtHomeError
        >>> from robolink.journal import CellHome, name_journals, require_home
        >>> address = "epson+sim://home-example"
        >>> name_journals({}, homes={address: CellHome("line3", "pc-of-line-3")})
        >>> try:
        ...     require_home(address)
        ... except NotAtHomeError as error:
        ...     print(error.what.partition(",")[0])
        The home of line3 is pc-of-line-3
    """
    error = not_at_home(address)
    if error is not None:
        raise error


def _first_label(name: str) -> str:
    return computer_key(name).partition(".")[0]
