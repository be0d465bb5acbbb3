"""Positions as the controller prints them: measured, found at an edge, or taught by a person."""

from collections.abc import Iterable

from robolink.controllers.epson.link.window import CommandWindow
from robolink.model import Pose
from robolink.protocols import spel


def read_position(window: CommandWindow, query: spel.Statement) -> Pose:
    """Read the position that ``query`` prints, of the tool in force."""
    tool = spel.parse_integer(window.printed(spel.print_selected_tool()))
    return _printed_pose(window, query, tool=tool)


class EpsonPoints:
    """The point memory, P0 to P999. Only read: robolink never changes a taught point.

    Source: docs/reference/spel.md 5.1.

    A point holds coordinates, flags and a local, but not the tool that was in force when
    it was taught (docs/reference/epson.md 3.2); so the poses returned here carry ``tool=None``.
    """

    def __init__(self, window: CommandWindow) -> None:
        self._window = window

    def read(self, number: int) -> Pose | None:
        """Read one point, ``None`` when it is not taught.

        Raises:
            LocalProtocolError: There is no such point; 0 to 999 exist.
            NotReadyError: The state would not allow it. In Teach nothing can be read.
        """
        return self.read_all((number,))[number]

    def read_all(self, numbers: Iterable[int]) -> dict[int, Pose | None]:
        """Read several points, in the order given; same errors as :meth:`read`.

        The point is asked for only when it is taught: printing another one would put the
        controller in error (docs/reference/spel.md 5.1).
        """
        wanted = [(number, spel.print_point_defined(number)) for number in numbers]
        if wanted:
            self._window.require_ready(wanted[0][1])
        return {
            number: _printed_pose(self._window, spel.print_point(number), tool=None)
            if self._taught(query)
            else None
            for number, query in wanted
        }

    def _taught(self, query: spel.Statement) -> bool:
        return spel.parse_boolean(self._window.printed(query))


def _printed_pose(window: CommandWindow, query: spel.Statement, *, tool: int | None) -> Pose:
    point = spel.parse_point(window.printed(query))
    x_mm, y_mm, z_mm, u_deg, *rest = point.coordinates
    v_deg, w_deg = rest or (0.0, 0.0)
    return Pose(
        x_mm,
        y_mm,
        z_mm,
        u_deg,
        v_deg,
        w_deg,
        hand=point.hand,
        local=point.local,
        tool=tool,
        posture=point.posture,
    )
