"""An act is declared once: its name, its parameters, and what it does."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

from robolink.errors import ConfigError
from robolink.messages import known_names, tr
from robolink.model import Pose
from robolink_simulators.control.answers import Described
from robolink_simulators.control.cell import ControlledCell

Answer = dict[str, object]
"""The result of an act, ready for JSON."""

Given = Mapping[str, Any]
"""The values passed to an act, by name, unchecked."""

MOST: Final = 9999
_FAR: Final = 1_000_000
LONGEST_TEXT: Final = 200
PRINTABLE: Final = "[ -~]*"
"""Regular expression for printable ASCII, with the same meaning in Python and JSON Schema."""

NONE: Final = "none"
"""The text that stands for null where a value comes from a shell."""

Form = Literal["whole", "number", "flag", "text"]


@dataclass(frozen=True, slots=True)
class Taken:
    """One parameter of an act.

    Attributes:
        name: Its name, with the unit in it.
        form: A whole number, a number, true or false (1 and 0 will do), or a text.
        needed: Whether it must be given.
        choices: The texts that there are, where not any will do.
        ascii: Whether it is a text of printable ASCII only.
        most: The highest number.
        least: The lowest number; of ``whole`` never below 0.
        default: What it is where it is not given; ``None`` for not given.
        or_none: Whether null is one, too, and the word for it.
    """

    name: str
    form: Form = "number"
    needed: bool = True
    choices: tuple[str, ...] = ()
    ascii: bool = False
    most: float = _FAR
    least: float = -_FAR
    default: object = None
    or_none: bool = False

    @property
    def whole_limits(self) -> tuple[int, int]:
        """The limits of a whole number."""
        return int(max(self.least, 0)), int(min(self.most, MOST))

    def checked(self, act: str, value: object) -> object:
        """Return the value, if it is allowed.

        Raises:
            ConfigError: It is something else.
        """
        if self.or_none and (value is None or value == NONE):
            return None
        if isinstance(value, float) and value.is_integer() and self.form in ("whole", "flag"):
            value = int(value)  # JSON has one type of number: 3.0 is an integer
        match self.form:
            case "whole":
                lowest, highest = self.whole_limits
                fits = type(value) is int and lowest <= value <= highest
            case "number":
                # A JSON integer may have hundreds of digits: compare before conversion to float.
                number = isinstance(value, (int, float)) and not isinstance(value, bool)
                fits = number and self.least <= value <= self.most  # type: ignore[operator]
            case "flag":
                fits = isinstance(value, bool) or (type(value) is int and value in (0, 1))
            case _:
                fits = isinstance(value, str) and self._is_one(value)
        if not fits:
            raise ConfigError(self._needs(act, value), remedy=self._example())
        return float(value) if self.form == "number" else value  # type: ignore[arg-type]

    def _is_one(self, text: str) -> bool:
        """Whether a text is one of the allowed ones."""
        if self.choices:
            return text in self.choices
        fits = len(text) <= LONGEST_TEXT
        return fits and (not self.ascii or re.fullmatch(PRINTABLE, text) is not None)

    def _needs(self, act: str, value: object) -> str:
        if self.choices and isinstance(value, str):
            return tr("{act} knows no {name} {value!r}.", act=act, name=self.name, value=value[:80])
        match self.form:
            case "whole":
                least, most = self.whole_limits
                return tr(
                    "{act} needs {name}, a whole number from {least} to {most}.",
                    act=act,
                    name=self.name,
                    least=least,
                    most=most,
                )
            case "number":
                return tr(
                    "{act} needs {name}, a number from {least:g} to {most:g}.",
                    act=act,
                    name=self.name,
                    least=self.least,
                    most=self.most,
                )
            case "flag":
                return tr("{act} needs {name}, true or false.", act=act, name=self.name)
            case "text" if self.ascii:
                return tr(
                    "{act} needs {name}, a text of printable ASCII without a line end.",
                    act=act,
                    name=self.name,
                )
            case _:
                return tr("{act} needs {name}, a text.", act=act, name=self.name)

    def _example(self) -> str:
        if self.choices:
            return known_names(self.choices)
        examples = {"whole": "1", "number": "1.5", "flag": "true", "text": '"a"'}
        return tr("Give it as {example}.", example=f'"{self.name}": {examples[self.form]}')


@dataclass(frozen=True, slots=True)
class ControlAct:
    """An action at a simulated cell, or a reading of it.

    Attributes:
        name: Its name.
        carry_out: Does it; the first line of its docstring says what it does.
        takes: What it takes.
        reads: Whether it changes nothing.
        gives: What describes its answer; ``None`` where that is no more than that it was done.
    """

    name: str
    carry_out: Callable[[ControlledCell, Given], Answer]
    takes: tuple[Taken, ...] = ()
    reads: bool = False
    gives: Described = None

    @property
    def says(self) -> str:
        """What it does, in a sentence."""
        lines = (self.carry_out.__doc__ or "").partition("\n\n")[0].split()
        return " ".join(lines)

    def checked(self, given: Given) -> dict[str, Any]:
        """Return the given values, if this act accepts them.

        Raises:
            ConfigError: Something is missing, wrong or unknown.
        """
        known = {taken.name: taken for taken in self.takes}
        for name in given:
            if name not in known:
                remedy = tr("It takes nothing.")
                if known:
                    remedy = tr("It takes: {names}.", names=", ".join(known))
                raise ConfigError(
                    tr("{act} takes no {name!r}.", act=self.name, name=str(name)[:80]),
                    remedy=remedy,
                )
        return {
            name: taken.checked(self.name, given.get(name, taken.default))
            for name, taken in known.items()
            if taken.needed or name in given
        }


ON: Final = Taken("on", "flag", default=True)
WHOLE_TOOL: Final = Taken("tool", "whole", needed=False)
NUMBER: Final = Taken("number", "whole")


def shown_flange(flange: Pose) -> dict[str, float]:
    """Return a flange pose in the form of an act's result."""
    x_mm, y_mm, z_mm, u_deg, _, _ = flange.coordinates()
    return {"x_mm": x_mm, "y_mm": y_mm, "z_mm": z_mm, "u_deg": u_deg}


def panel_act(panel: type, name: str, *takes: Taken, method: str = "") -> ControlAct:
    """Return the act for a method of the simulator's panel.

    Args:
        panel: The class of the panel.
        name: Its name.
        takes: What the method takes, in its order.
        method: The method's name, where it is another one.
    """

    def act(cell: ControlledCell, given: Given) -> Answer:
        getattr(cell.simulator.panel, method or name)(*given.values())
        return {}

    act.__doc__ = getattr(panel, method or name).__doc__
    return ControlAct(name, act, takes)
