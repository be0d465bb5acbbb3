"""What must be so before a movement begins, beyond what the controller itself asks for.

A key switch that a cell names, a person at a page who may have gone: whoever knows of such a thing
puts it up for a block, and every movement of a runner on that controller passes it, by hand or not.
"""

from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from typing import Protocol

from robolink.model import Controller


class MovementPermit(Protocol):
    """Lets a movement begin."""

    def __call__(self, *, by_hand: bool) -> AbstractContextManager[object]:
        """Return a block in which the movement is made.

        Entering it waits until the movement may begin, or raises an error of robolink where it may
        not. A step by hand is not to be waited for: the finger is gone by then.

        Args:
            by_hand: Whether it is a step that a person asked for just now.
        """


_permits: dict[int, list[MovementPermit]] = {}
"""The permits of the controllers of this process, by the object."""


@contextmanager
def permitted_by(controller: Controller, permit: MovementPermit) -> Iterator[None]:
    """Let every movement of a runner on ``controller`` wait for ``permit``, for the block.

    Args:
        controller: The controller.
        permit: Entered before each movement is sent, left at its end.

    Example:
        >>> from contextlib import nullcontext
        >>> import robolink
        >>> from robolink.runner import permitted_by
        >>> def free(*, by_hand):
        ...     return nullcontext()
        >>> with robolink.connect("epson+sim://docs?seed=7") as robot:
        ...     with permitted_by(robot, free):
        ...         pass  # runners wait for it here
    """
    mine = _permits.setdefault(id(controller), [])
    mine.append(permit)
    try:
        yield
    finally:
        mine.remove(permit)
        if not mine:
            _permits.pop(id(controller), None)


def movement_permit(controller: Controller, *, by_hand: bool) -> AbstractContextManager[object]:
    """Return a block with every permit of a controller, for one movement."""
    permits = tuple(_permits.get(id(controller), ()))
    return _all_given(permits, by_hand=by_hand) if permits else nullcontext()


@contextmanager
def _all_given(permits: Iterable[MovementPermit], *, by_hand: bool) -> Iterator[None]:
    with ExitStack() as stack:
        for permit in permits:
            stack.enter_context(permit(by_hand=by_hand))
        yield
