"""The desk of this process's person, while a wizard shows it."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from robolink.runner import Question


class AskingDesk(Protocol):
    """Where a wizard's questions arrive; a :class:`~robolink.runner.GuidedOperator`.

    Attributes:
        glance: Looks at the controller while a person is asked.
        silent_s: Tells for how long nothing was heard of the person's page, in seconds; 0 where
            the person is here.
    """

    glance: Callable[[], Any]
    silent_s: Callable[[], float]

    def tell(self, text: str) -> None:
        """Show something that needs no answer."""

    def look(self) -> None:
        """Look at the controller now, and show what was read."""

    def regard(self, subject: object) -> None:
        """Note ``subject`` as the subject of what comes next."""

    def ask(self, question: str, kind: "Question") -> None:
        """Ask."""

    def wait_while(self, why: Callable[[], str]) -> None:
        """Wait as long as something keeps the work back, and say what."""

    def following(self, look: Callable[[], Any]) -> AbstractContextManager[None]:
        """Read the controller while it moves, for the block."""

    def poll(self, wait_s: float) -> str | None:
        """Return the answer, ``None`` if none came within ``wait_s``."""


_desk: AskingDesk | None = None


def current_desk() -> AskingDesk | None:
    """Return the desk, ``None`` if questions are plain lines."""
    return _desk


@contextmanager
def sitting_at(desk: AskingDesk) -> Iterator[None]:
    """Ask every question of this process at ``desk``, for the block."""
    global _desk  # noqa: PLW0603 - a process has one terminal, and one person at it
    before, _desk = _desk, desk
    try:
        yield
    finally:
        _desk = before
