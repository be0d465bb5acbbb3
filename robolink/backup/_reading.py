"""Strict JSON: every refusal names the place in the file."""

import json
import math
from collections.abc import Sequence
from typing import NoReturn

from robolink.errors import ConfigError
from robolink.messages import tr


class JsonReader:
    """Reads one document.

    Args:
        source: What an error calls the file.
    """

    def __init__(self, source: str) -> None:
        self.source = source

    def document(self, text: str) -> object:
        """Return the document; a name that stands twice and NaN are refused.

        Raises:
            ConfigError: It is no JSON.
        """
        try:
            found: object = json.loads(
                text, object_pairs_hook=self._once, parse_constant=self._no_constant
            )
        except ConfigError:
            raise
        except (ValueError, RecursionError) as error:
            raise self.wrong("", tr("it is not JSON ({cause})", cause=error)) from error
        return found

    def members(self, value: object, path: str, names: Sequence[str]) -> dict[str, object]:
        """Return an object that has exactly these members, in this order."""
        if not isinstance(value, dict):
            raise self.wrong(path, tr("it is not an object in braces"))
        for name in value:
            if name not in names:
                raise self.wrong(_joined(path, name), tr("this name is not known here"))
        for name in names:
            if name not in value:
                raise self.wrong(_joined(path, name), tr("it is missing"))
        return {name: value[name] for name in names}

    def text(self, value: object, path: str) -> str:
        """Return a text."""
        if not isinstance(value, str):
            raise self.wrong(path, tr("{value!r} is not text", value=value))
        return value

    def texts(self, value: object, path: str) -> tuple[str, ...]:
        """Return a list of texts."""
        if not isinstance(value, list):
            raise self.wrong(path, tr("{value!r} is not a list", value=value))
        return tuple(self.text(item, f"{path}.{i}") for i, item in enumerate(value))

    def whole(self, value: object, path: str, lowest: int, highest: int) -> int:
        """Return a whole number in a range."""
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.wrong(path, tr("{value!r} is not a whole number", value=value))
        if not lowest <= value <= highest:
            raise self.wrong(
                path,
                tr(
                    "{value} is not from {lowest} to {highest}",
                    value=value,
                    lowest=lowest,
                    highest=highest,
                ),
            )
        return value

    def number(self, value: object, path: str) -> float:
        """Return a finite number."""
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.wrong(path, tr("{value!r} is not a number", value=value))
        try:
            found = float(value)
        except OverflowError:
            found = math.inf
        if not math.isfinite(found):
            raise self.wrong(path, tr("it is not a finite number"))
        return found

    def wrong(self, path: str, cause: str) -> ConfigError:
        """Return the error for one place of the file."""
        place = path or tr("the file")
        return ConfigError(
            tr("{source}: {place}: {cause}.", source=self.source, place=place, cause=cause),
            remedy=tr("Nothing was sent. Correct it by hand, or use another backup."),
        )

    def _once(self, pairs: list[tuple[str, object]]) -> dict[str, object]:
        found: dict[str, object] = {}
        for name, value in pairs:
            if name in found:
                raise self.wrong(name, tr("it appears twice"))
            found[name] = value
        return found

    def _no_constant(self, constant: str) -> NoReturn:
        raise self.wrong("", tr("{constant} is not a number", constant=constant))


def _joined(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name
