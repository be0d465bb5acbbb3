"""A command at work on a controller, until it is done or ended from outside."""

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from robolink.errors import RobolinkError
from robolink.interrupts import ended_by

if TYPE_CHECKING:
    from robolink.model import Controller, Marker


@dataclass
class Begun:
    """What was begun.

    Attributes:
        at_s: When, in wall-clock seconds: the journal labels its entries with that clock.
        controller: The controller, ``None`` until it is reached.
    """

    at_s: float
    controller: "Controller | None" = None

    @contextmanager
    def looking_once_more(self, found: "Collection[Marker]") -> Iterator[None]:
        """Say at an ending what state the controller was left in, as it shows itself then.

        Args:
            found: The markers that were open before, which are not of this command.

        Raises:
            CommandEnded: In place of the ending, with the state.
        """
        try:
            yield
        except KeyboardInterrupt as error:
            from robolink_cli._ending import command_ended

            assert self.controller is not None  # noqa: S101 - the block works on it
            left = [m for m in self.controller.outcomes.open_markers() if m not in found]
            raise command_ended(error, self.controller, self.at_s, left) from error
        except RobolinkError as error:
            if ended_by() is not None and self.controller is not None:
                from robolink_cli._ending import state_now

                # What came of the cleaning up has the last word on the exit code.
                error.remedy = f"{error.remedy} {state_now(self.controller, self.at_s)}".strip()
            raise

    @contextmanager
    def ending_in_words(self) -> Iterator[None]:
        """Say at an ending before the controller was reached, or at the logout, what was written.

        Raises:
            CommandEnded: In place of the ending, with what is known without the controller.
        """
        try:
            yield
        except KeyboardInterrupt as error:
            from robolink_cli._ending import CommandEnded, ended_out_of_reach

            if isinstance(error, CommandEnded):
                raise
            raise ended_out_of_reach(error, self.controller, self.at_s) from error
