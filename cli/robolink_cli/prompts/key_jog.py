"""An operator who presses keys instead of typing steps."""

from collections.abc import Callable
from typing import Final

from robolink.errors import DeclinedError
from robolink.messages import tr
from robolink.model import Pose, WorkBox
from robolink.runner import POLL_S, Question
from robolink_cli.console.render import note
from robolink_cli.prompts.keyboard import Keyboard
from robolink_cli.prompts.keys import Key
from robolink_cli.prompts.lines import QUIET_S

STEPS: Final = (0.01, 0.1, 1.0, 5.0)
"""Step sizes in mm, and in degrees for U; the largest is the runner's own limit."""

_AXES: Final = {
    Key.RIGHT: "x+",
    Key.LEFT: "x-",
    Key.UP: "y+",
    Key.DOWN: "y-",
    Key.PAGE_UP: "z+",
    Key.PAGE_DOWN: "z-",
    Key.GREATER: "u+",
    Key.LESS: "u-",
}
_SIZES: Final = {Key.PLUS: 1, Key.MINUS: -1}

_BURST: Final = 30
"""So many keys are waited out before a question: one that is held down never ends."""


def agree_by_key(question: str, keys: Keyboard, *, watch: Callable[[], object]) -> None:
    """Ask for y or n, calling ``watch`` meanwhile; the line prompt would keep the input.

    What was pressed before counts for nothing; what is neither, or comes in a burst as from a
    scanner, is asked once more and is a no then.

    Raises:
        DeclinedError: It was not a y, or the terminal is gone.
    """
    for _ in range(2):
        for _dropped in range(_BURST):
            if not _read(keys, QUIET_S):
                break
        note(tr("{question} [y or n]", question=question))
        while not (pressed := _read(keys, POLL_S)):
            watch()
        pressed += _read(keys, QUIET_S)
        if pressed == [Key.YES]:
            return
        if Key.NO in pressed:
            break
    raise DeclinedError(tr("That was not y."), remedy=tr("Nothing was sent."))


class KeyOperator:
    """Gives the runner one typed step per key, so that its limits and its watch hold.

    What is pressed while the robot moves is dropped: a key that repeats must not queue up
    movements that go on after it is released.

    Args:
        keys: Where keys come from.
        position: Reads where the tool is.
        box: Where it may go.
        show: Shows a person a line.
    """

    def __init__(
        self,
        keys: Keyboard,
        position: Callable[[], Pose],
        box: WorkBox,
        show: Callable[[str], None],
    ) -> None:
        self._keys = keys
        self._position = position
        self._box = box
        self._show = show
        self._step = 1
        self._stepped = False

    def tell(self, text: str) -> None:
        """Show a line."""
        self._show(text)

    def ask(self, question: str, kind: Question) -> None:  # noqa: ARG002 - only places are asked
        """Show the keys, the limits and where the tool is."""
        self._show(question)
        self._show(tr("  arrows X Y | PageUp PageDown Z | < > U | + - step size | q or ENTER ends"))
        self._show(
            tr(
                "  box: X {x[0]:.3f} to {x[1]:.3f}  Y {y[0]:.3f} to {y[1]:.3f}  "
                "Z {z[0]:.3f} to {z[1]:.3f} mm; steps: {steps} mm or degrees; Power Low",
                x=(self._box.x_min_mm, self._box.x_max_mm),
                y=(self._box.y_min_mm, self._box.y_max_mm),
                z=(self._box.z_min_mm, self._box.z_max_mm),
                steps=" ".join(f"{step:g}" for step in STEPS),
            )
        )
        self._show_position()

    def poll(self, wait_s: float) -> str | None:
        """Return a step, an empty line for the end, ``None`` when no key came.

        Raises:
            DeclinedError: The terminal is gone.
        """
        if self._stepped:
            self._stepped = False
            if Key.END in _read(self._keys, 0):
                return ""
            self._show_position()
        return self._answer_to(_read(self._keys, wait_s))

    def _answer_to(self, pressed: list[Key]) -> str | None:
        """Of keys that came at once, take the first step only, unless one of them ends it."""
        if Key.END in pressed:
            return ""
        for key in pressed:
            if key in _AXES:
                self._stepped = True
                return f"{_AXES[key]}{STEPS[self._step]:g}"
            if key in _SIZES:
                self._step = min(max(self._step + _SIZES[key], 0), len(STEPS) - 1)
                self._show_position()
        return None

    def _show_position(self) -> None:
        pose = self._position()
        self._show(
            tr(
                "  X {x:9.3f}  Y {y:9.3f}  Z {z:9.3f}  U {u:9.3f}   step {step:g}",
                x=pose.x_mm,
                y=pose.y_mm,
                z=pose.z_mm,
                u=pose.u_deg,
                step=STEPS[self._step],
            )
        )


def _read(keys: Keyboard, wait_s: float) -> list[Key]:
    try:
        return keys.read(wait_s)
    except EOFError as error:
        raise DeclinedError(
            tr("The terminal is gone."), remedy=tr("The robot stands where it was.")
        ) from error
