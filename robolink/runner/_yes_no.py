"""What counts as a yes and as a no, wherever a person is asked."""

from collections.abc import Callable, Collection
from typing import Final

from robolink.messages import tr
from robolink.runner._operator import Operator, Question

_YES: Final = frozenset({"y", "yes", "j", "ja", "是"})
MORE: Final = "more"
"""The word for one more touch than planned."""

BACK: Final = "back"
"""The word for going back to the touches."""

_NO: Final = frozenset({"n", "no", "nein", "否"})


def yes_or_no(line: str) -> bool | None:
    """Return what a typed line says; ``None`` when it is neither a yes nor a no."""
    word = line.strip().casefold()
    if word in _YES:
        return True
    return False if word in _NO else None


def ask_yes_no(operator: Operator, question: str, answer: Callable[[], str]) -> bool:
    """Ask; what is neither yes nor no is asked once more, and then it is a no.

    A barcode or a key held down is neither, and must not decide anything.

    Args:
        operator: Who is asked.
        question: What a yes agrees to.
        answer: Fetches the next line that the person types.

    Example:
        >>> from robolink.runner import ask_yes_no
        >>> class Person:
        ...     def ask(self, question, kind):
        ...         print(question)
        ...     def tell(self, text):
        ...         print(text)
        >>> ask_yes_no(Person(), "Write tool 1?", lambda: "y")
        Write tool 1?
        True
    """
    return ask_yes_no_or(operator, question, answer, also=()) is True


def ask_yes_no_or(
    operator: Operator, question: str, answer: Callable[[], str], *, also: Collection[str]
) -> bool | str:
    """Ask as :func:`ask_yes_no` does, of somebody who may also answer with one of further words.

    Args:
        operator: Who is asked.
        question: What a yes agrees to.
        answer: Fetches the next line that the person types.
        also: The words; one of them is returned as it stands here.

    Example:
        >>> from robolink.runner import ask_yes_no_or
        >>> class Panel:  # implements robolink.Operator
        ...     def ask(self, question, kind):
        ...         print(question)
        >>> lines = iter(["more"])
        >>> ask_yes_no_or(Panel(), "Keep it?", lambda: next(lines), also=("more",))
        Keep it?
        'more'
    """
    for left in (1, 0):
        operator.ask(question, Question.YES_NO)
        line = answer().strip()
        if line in also:
            return line
        said = yes_or_no(line)
        if said is not None or not left:
            break
        operator.tell(
            tr(
                "{line!r} is neither yes nor no. It is asked once more; then anything but a yes "
                "counts as no.",
                line=line,
            )
        )
    return said is True
