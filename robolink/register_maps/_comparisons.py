"""Compares the screen of a machine with what its map finds.

A probe tells word order and offset; neither it nor one value tells that Y and Z are not exchanged,
or that the map of tool 1 does not lead to tool 2. So each component is compared, and each tool by
one value at least, and a value tells only what no other value of the map would have told as well.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Final, NamedTuple, Self

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.register_maps._places import COMPONENTS, AnyMap, PlacedNumber

_FINEST: Final = 2
"""Number of decimals that a comparison needs: hundredths of a millimetre or degree."""

_SLACK: Final = 1e-6
"""Largest difference between a REAL and its decimal number, in units of the last digit shown."""

_PLAIN: Final = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)", re.ASCII)

_TEST_VALUES: Final = (7.3, 4.6, 8.9, 5.2, 9.7, 6.1, 3.4, 2.8, 1.5)
"""Values small enough for any tool and register, and unlike the round numbers that others use in
tests."""


class MapDiffersError(ConfigError):
    """The map finds another value than the machine's own screen shows: the map is wrong."""


class MapValue(NamedTuple):
    """One component of one tool, written as ``1.x``."""

    tool: int
    component: str

    def __str__(self) -> str:
        return f"{self.tool}.{self.component}"

    @classmethod
    def named(cls, text: str, register_map: AnyMap) -> Self:
        """Return the value of a map that ``text`` names.

        Raises:
            ConfigError: It names none.
        """
        keys = [cls(*key) for key in values_of(register_map)]
        for key in keys:
            if str(key) == text.strip():
                return key
        raise ConfigError(
            tr("{answer!r} names no value of this map.", answer=text),
            remedy=tr("Write for example {key}=12.35.", key=keys[0]),
        )


@dataclass(frozen=True, slots=True)
class ComparedValue:
    """One value that a person compared.

    Attributes:
        value: Which.
        shown: What the screen showed, as it was typed.
        tells_component: Whether no other component of the tool read the same.
        tells_tool: Whether this component of no other tool read the same.
    """

    value: MapValue
    shown: str
    tells_component: bool = True
    tells_tool: bool = True

    def __str__(self) -> str:
        return f"{self.value}={self.shown}"


@dataclass(frozen=True, slots=True)
class OpenValue:
    """One value still to be compared.

    Attributes:
        value: Which.
        why_not: Why what stands there now would not tell; empty where it would.
        test_mm_or_deg: What to enter there for the comparison; ``None`` where nothing need be.
    """

    value: MapValue
    why_not: str = ""
    test_mm_or_deg: float | None = None


Found = Mapping[MapValue, float]
"""Values found by the map, in mm and degrees; unreadable values are missing."""


def values_of(register_map: AnyMap) -> dict[MapValue, PlacedNumber]:
    """Return every component of every tool of a map."""
    return {
        MapValue(slot.tool, name): slot.components[name]
        for slot in register_map.slots.values()
        for name in COMPONENTS
        if name in slot.components
    }


def compare(register_map: AnyMap, found: Found, value: MapValue, shown: str) -> ComparedValue:
    """Compare one value with the machine's own screen.

    The screen may round or cut off; that many digits are compared as were typed, and too few of
    them, or digits that another value shows too, confirm nothing.

    Args:
        register_map: The map.
        found: What it finds now.
        value: Which value.
        shown: What the screen shows, in mm or degrees.

    Raises:
        MapDiffersError: The map finds something else.
        ConfigError: What was typed tells nothing about the map.

    Example:
        >>> from pathlib import Path
        >>> from robolink.register_maps import MapValue, compare, load_map
        >>> from robolink_simulators.testkit.operator import written_map
        >>> register_map = load_map(written_map(Path.cwd()))
        >>> found = {MapValue(1, "x"): 12.5, MapValue(1, "y"): -3.25}
        >>> str(compare(register_map, found, MapValue(1, "x"), "12.50"))
        '1.x=12.50'
    """
    text, typed, digits = _read(value, shown)
    _require_alike(found, value, text, typed, digits)
    needed = _digits_needed(values_of(register_map)[value])
    if digits < needed:
        raise ConfigError(
            tr(
                "{shown!r} cannot confirm {key}: at least {count} digits after the point are "
                "needed.",
                shown=text,
                key=value,
                count=needed,
            ),
            remedy=tr("Type zeros too. If the screen shows fewer: compare a test value there."),
        )
    return _telling(found, value, text, typed, digits)


def compare_test(
    register_map: AnyMap, before: Found, found: Found, value: MapValue, entered: str
) -> ComparedValue:
    """Compare one value with what a person has just entered at the machine's own screen.

    All digits of such a value are known, however few the screen shows.

    Args:
        register_map: The map.
        before: What the map found before it was entered.
        found: What it finds now.
        value: Which value.
        entered: What was entered there, in mm or degrees.

    Raises:
        MapDiffersError: The map finds something else.
        ConfigError: What was entered tells nothing about the map.

    Example:
        >>> from pathlib import Path
        >>> from robolink.register_maps import MapValue, compare_test, load_map
        >>> from robolink_simulators.testkit.operator import written_map
        >>> register_map = load_map(written_map(Path.cwd()))
        >>> y, z = MapValue(1, "y"), MapValue(1, "z")
        >>> str(compare_test(register_map, {y: 0, z: 0}, {y: 7.3, z: 0}, y, "7.3"))
        '1.y=7.3'
    """
    text, typed, digits = _read(value, entered)
    _require_alike(found, value, text, typed, digits)
    allowed = max(_step(values_of(register_map)[value]), 0.5 * 10.0**-_FINEST)
    if abs(found[value] - typed) > allowed * (1 + _SLACK):
        raise _differs(found, value, text, typed, digits)
    if value in before and _alike(before[value], typed, digits):
        raise ConfigError(
            tr(
                "{key} already read {shown} before, so this confirms nothing.",
                **_said(value, text),
            ),
            remedy=tr("Enter another value at the machine's own screen."),
        )
    return _telling(found, value, text, typed, digits)


def to_compare(
    register_map: AnyMap, found: Found, compared: Mapping[MapValue, ComparedValue]
) -> list[OpenValue]:
    """Return the values that, with those already compared, show that a map is right.

    Args:
        register_map: The map.
        found: What it finds now.
        compared: What was compared before.

    Example:
        >>> from pathlib import Path
        >>> from robolink.register_maps import load_map, to_compare
        >>> from robolink_simulators.testkit.operator import written_map
        >>> wanted = to_compare(load_map(written_map(Path.cwd())), {}, {})
        >>> [str(one.value) for one in wanted]  # and what is to be entered there for it
        ['1.x', '1.y', '1.z', '1.u', '2.x']
    """
    plan = _Plan(register_map, found, compared)
    for value in values_of(register_map):
        if not component_known(register_map, plan.told, value):
            plan.add(value, lambda one: one.tells_component, _like(register_map, value))
    for tool, slot in register_map.slots.items():
        if not tool_known(plan.told, tool):
            own = [MapValue(tool, name) for name in COMPONENTS if name in slot.components]
            plan.add(own[0], lambda one: one.tells_tool, own)
    return plan.wanted


def tool_known(compared: Mapping[MapValue, ComparedValue], tool: int) -> bool:
    """Whether a comparison showed that this tool's place is not another tool's."""
    return any(one.tells_tool for value, one in compared.items() if value.tool == tool)


def component_known(
    register_map: AnyMap, compared: Mapping[MapValue, ComparedValue], value: MapValue
) -> bool:
    """Whether a comparison showed this component, at this tool or one with the same layout."""
    alike = _like(register_map, value)
    return any(one.tells_component for other, one in compared.items() if other in alike)


class _Plan:
    """The values to compare, and what will be known afterwards."""

    def __init__(
        self, register_map: AnyMap, found: Found, compared: Mapping[MapValue, ComparedValue]
    ) -> None:
        self._numbers = values_of(register_map)
        self._found = found
        self.told = dict(compared)
        self.wanted: list[OpenValue] = []

    def add(
        self, first: MapValue, tells: Callable[[ComparedValue], bool], choice: list[MapValue]
    ) -> None:
        """Choose a present value that is informative, best one that does both; or a test value."""
        made = [one for value in choice if (one := self._as_it_stands(value)) and tells(one)]
        for one in sorted(made, key=lambda one: not (one.tells_component and one.tells_tool)):
            self.told[one.value] = one
            self.wanted.append(OpenValue(one.value))
            return
        self.told[first] = ComparedValue(first, "")
        self.wanted.append(OpenValue(first, self._why_not(first), self._test_value(first)))

    def _as_it_stands(self, value: MapValue) -> ComparedValue | None:
        digits = _digits_needed(self._numbers[value])
        shown = round(self._found.get(value, 0.0), digits)
        return _tells(self._found, value, "", shown, digits) if shown else None

    def _why_not(self, value: MapValue) -> str:
        found, digits = self._found.get(value), _digits_needed(self._numbers[value])
        if found is None:
            return tr("{key} cannot be read now.", key=value)
        if not round(found, digits):
            return tr("{key} reads 0, which is what many registers hold.", key=value)
        others = ", ".join(map(str, _reading(self._found, value, round(found, digits), digits)))
        return tr(
            "{key} reads {found:g} and so does {others}: it would not show if they were exchanged.",
            key=value,
            found=found,
            others=others,
        )

    def _test_value(self, value: MapValue) -> float:
        taken = [*self._found.values(), *(w.test_mm_or_deg or 0.0 for w in self.wanted)]
        step = _step(self._numbers[value])
        free = (it for it in _TEST_VALUES if all(abs(abs(other) - it) > 0.2 for other in taken))
        test = next(chain(free, (_TEST_VALUES[0],)))
        return test if step <= 0.1 else round(test / step) * step or step


def _read(value: MapValue, shown: str) -> tuple[str, float, int]:
    """Return a typed number with its decimal point, and how many digits follow it."""
    text = shown.strip().replace(",", ".")
    if not _PLAIN.fullmatch(text):
        raise ConfigError(
            tr("{shown!r} is not a number.", shown=shown),
            remedy=tr("Type what the HMI shows for {key}, in mm or degrees.", key=value),
        )
    return text, float(text), len(text.partition(".")[2])


def _alike(found: float, shown: float, digits: int) -> bool:
    """Whether a screen with so many digits shows ``found`` as ``shown``, rounded or cut off."""
    unit = 10.0**-digits
    slack = unit * _SLACK + 1e-7 * abs(shown)
    if abs(found - shown) <= unit / 2 + slack:
        return True
    return found * shown >= 0 and -slack <= abs(found) - abs(shown) < unit - slack


def _reading(found: Found, value: MapValue, shown: float, digits: int) -> list[MapValue]:
    """Return which other values the same digits would have confirmed."""
    return [
        other for other, held in found.items() if other != value and _alike(held, shown, digits)
    ]


def _require_alike(found: Found, value: MapValue, text: str, typed: float, digits: int) -> None:
    if value not in found:
        raise ConfigError(
            tr("{key} cannot be read now.", key=value),
            remedy=tr("Enter the tool's values at the machine's own screen, then compare."),
        )
    if not _alike(found[value], typed, digits):
        raise _differs(found, value, text, typed, digits)
    if not typed:
        raise ConfigError(
            tr("{key} reads 0, and a 0 confirms nothing.", key=value),
            remedy=tr(
                "Enter a test value for it at the machine's own screen, compare that, and put the "
                "0 back there."
            ),
        )


def _telling(found: Found, value: MapValue, text: str, typed: float, digits: int) -> ComparedValue:
    made = _tells(found, value, text, typed, digits)
    if made.tells_component or made.tells_tool:
        return made
    others = ", ".join(map(str, _reading(found, value, typed, digits)))
    raise ConfigError(
        tr(
            "{key} reads {shown} and so does {others}: it would not show if they were exchanged.",
            others=others,
            **_said(value, text),
        ),
        remedy=tr("Enter a test value for it at the machine's own screen, and compare that."),
    )


def _tells(found: Found, value: MapValue, text: str, shown: float, digits: int) -> ComparedValue:
    others = _reading(found, value, shown, digits)
    return ComparedValue(
        value,
        text,
        tells_component=not any(other.tool == value.tool for other in others),
        tells_tool=not any(other.component == value.component for other in others),
    )


def _differs(
    found: Found, value: MapValue, text: str, typed: float, digits: int
) -> MapDiffersError:
    others = _reading(found, value, typed, digits) if typed else []
    elsewhere = (
        tr("That is what {others} reads: perhaps the map has them exchanged.", others=others[0])
        if others
        else tr("Compare place, type, word_order, scale and unit with the PLC's own list.")
    )
    return MapDiffersError(
        tr(
            "The HMI shows {shown} for {key}, the map finds {found:.4f}.",
            found=found[value],
            **_said(value, text),
        ),
        remedy=tr("The map is not confirmed. {elsewhere}", elsewhere=elsewhere),
    )


def _said(value: MapValue, text: str) -> dict[str, object]:
    return {"key": value, "shown": text}


def _digits_needed(number: PlacedNumber) -> int:
    """Return how many decimals show a number to hundredths, or to its own step."""
    step = _step(number)
    return next((d for d in range(_FINEST) if step * 10**d >= 1 - _SLACK), _FINEST)


def _step(number: PlacedNumber) -> float:
    return abs(number.factor) if number.type.whole else 0.0


def _like(register_map: AnyMap, value: MapValue) -> list[MapValue]:
    """Return this component of all tools with the same layout."""
    layout = register_map.slots[value.tool].layout
    return [
        MapValue(slot.tool, value.component)
        for slot in register_map.slots.values()
        if slot.layout == layout
    ]
