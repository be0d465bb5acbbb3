"""What a check is given, and how it reports a broken promise."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace

from robolink.errors import OutcomeUnknownError, ProtocolError, RobolinkError, TransportError
from robolink.model import Controller, ToolOffset


class ContractBrokenError(AssertionError):
    """A controller breaks a promise that every kind of controller makes."""


@dataclass(frozen=True, slots=True)
class Subject:
    """The controller under test.

    Attributes:
        connect: Connects anew; called once or twice by each check, which closes what it opened.
        tool: A tool that may be written and cleared; it holds what it held at the end.
        prepare: Brings a fresh connection to where it may move: motors on, for example.
        step_mm: How far the checks that move go up and down again.
    """

    connect: Callable[[], Controller]
    tool: int = 1
    prepare: Callable[[Controller], None] = lambda _controller: None
    step_mm: float = 1.0

    @contextmanager
    def kept(self) -> Iterator[Controller]:
        """Connect for a block, and restore the tool and the selection at its end.

        Ctrl-C, or an error of robolink, that ended the block is told in place of what it then
        keeps from being put back.
        """
        with self.connect() as controller:
            before, selected = controller.tools.read(self.tool), controller.tools.selected()
            try:
                yield controller
            except (RobolinkError, KeyboardInterrupt):
                with suppress(RobolinkError):
                    self.put_back(controller, before, selected)
                raise
            except BaseException:
                self.put_back(controller, before, selected)
                raise
            else:
                self.put_back(controller, before, selected)

    def put_back(
        self, controller: Controller, before: ToolOffset | None, selected: int | None
    ) -> None:
        """Restore the tool's value and the selection.

        Args:
            controller: A connection to the controller.
            before: What the tool held, ``None`` where it was not defined.
            selected: The tool that was in force, ``None`` where the kind tells of none.

        Example:
            >>> from robolink import ToolOffset
            >>> from robolink.controllers import SimpleController, SimpleMachine
            >>> from robolink.testing import Subject
            >>> machine = SimpleMachine(tools={1: ToolOffset(12, -3.5, -20)}, selected=1)
            >>> subject = Subject(lambda: SimpleController(machine), tool=2)
            >>> with subject.connect() as controller:
            ...     receipt = controller.tools.write(2, ToolOffset(1, 2, 3), expected=None)
            ...     subject.put_back(controller, before=None, selected=1)
            ...     print(controller.tools.read(2))
            None
        """
        controller.release_stop()
        tools = controller.tools
        now = tools.read(self.tool)
        if before is not None:
            tools.write(self.tool, before, expected=now)
        if selected is not None and tools.selected() != selected:
            tools.select(selected)
        if before is None and now is not None:
            tools.clear(self.tool, expected=now, then_select=selected or 0)

    @contextmanager
    def movable(self) -> Iterator[Controller]:
        """Connect for a block in which the robot may be moved."""
        with self.connect() as controller:
            self.prepare(controller)
            yield controller

    @contextmanager
    def releasing_stop(self, controller: Controller) -> Iterator[None]:
        """Surround a stop that a check gives: the stop is released whatever ends the block.

        That of somebody else, who stops the checks, stays.

        Args:
            controller: What is stopped.
        """
        try:
            yield
        finally:
            controller.release_stop()
            # A held stop, or motors that were switched off, must not affect the next check; there
            # may be nothing to reset.
            with suppress(RobolinkError), controller.uninterrupted():
                controller.reset_fault()


Check = Callable[[Subject], None]
"""A check of one promise; raises :class:`ContractBrokenError` if it is broken."""


def require(kept: object, promise: str) -> None:
    """Report a broken promise unless it is kept.

    Raises:
        ContractBrokenError: It is not.
    """
    if not kept:
        raise ContractBrokenError(promise)


def another_offset(value: ToolOffset | None) -> ToolOffset:
    """Return an offset that no controller treats as the same."""
    return ToolOffset(10.0, 20.0, 30.0) if value is None else replace(value, x_mm=value.x_mm + 0.5)


@contextmanager
def refused(
    kinds: type[RobolinkError] | tuple[type[RobolinkError], ...], promise: str
) -> Iterator[None]:
    """Surround what must be refused by an error of one kind, or of one of several.

    Raises:
        ContractBrokenError: It was not, or by another error.
        RobolinkError: The link is gone, or nobody knows what was done: that refuses nothing.
    """
    try:
        yield
    except kinds:
        return
    except (TransportError, ProtocolError, OutcomeUnknownError):
        raise
    except RobolinkError as error:
        raise ContractBrokenError(f"{promise}: {type(error).__name__} instead: {error}") from error
    names = (kind.__name__ for kind in (kinds if isinstance(kinds, tuple) else (kinds,)))
    raise ContractBrokenError(f"{promise}: {' or '.join(names)} was not raised")
