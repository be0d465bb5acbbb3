"""The values that a map finds in a PLC, and how they compare with what the HMI shows."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from robolink.errors import ConfigError, RobolinkError
from robolink.messages import tr
from robolink.register_maps import COMPONENTS, Number, RegisterMap
from robolink_cli.console.numbers import decimal
from robolink_cli.console.render import note, table

if TYPE_CHECKING:
    from robolink.controllers.plc_map import PlcMapController


class MapDiffersError(ConfigError):
    """The map finds something else than the HMI shows: it is wrong."""


class MapValues:
    """What stands in the registers of the tools now; reads only.

    Attributes:
        values: By key, as ``1.x``: mm or degrees.
        unreadable: For each tool that cannot be read, why.
    """

    def __init__(self, controller: "PlcMapController") -> None:
        self._map = controller.register_map
        self._numbers = {
            f"{slot.tool}.{name}": number
            for slot in self._map.slots.values()
            for name, number in slot.components.items()
        }
        self.values: dict[str, float] = {}
        self.unreadable: dict[int, str] = {}
        for tool in controller.tools.indices():
            try:
                offset = controller.tools.read(tool)
            except RobolinkError as error:
                self.unreadable[tool] = str(error)
                continue
            found = dict(zip(COMPONENTS, offset.components(), strict=True)) if offset else {}
            mapped = self._map.slots[tool].components
            self.values |= {f"{tool}.{name}": found[name] for name in mapped if found}

    def payload(self) -> dict[str, object]:
        """Return it as plain JSON; lengths in mm, angles in degrees."""
        return {
            "name": self._map.name,
            "sha256": self._map.sha256,
            "values": dict(self.values),
            "unreadable": {str(tool): why for tool, why in self.unreadable.items()},
        }

    def show(self) -> None:
        """Show it to a person who stands at the HMI."""
        rows = [
            [
                key,
                number.place,
                number.type,
                f"{self.values[key]:.4f}" if key in self.values else "-",
            ]
            for key, number in self._numbers.items()
        ]
        columns = (tr("tool"), tr("place"), tr("type"), tr("mm or deg"))
        table(tr("{name}: what the map finds", name=self._map.name), columns, rows)
        for why in self.unreadable.values():
            note(why)

    def to_compare(self) -> list[str]:
        """Return one value of each way in which numbers stand in this map; none of them 0.

        Raises:
            ConfigError: All values of one way are 0, or cannot be read.
        """
        chosen: dict[object, str] = {}
        for key, number in self._numbers.items():
            if self.values.get(key):
                chosen.setdefault(_way(number), key)
        for key, number in self._numbers.items():
            if _way(number) not in chosen:
                raise ConfigError(
                    tr(
                        "{key} reads 0 or nothing, which does not show that a map is right.",
                        key=key,
                    ),
                    remedy=tr("Give it another value at the HMI for the comparison."),
                )
        return list(chosen.values())

    def compared(self, answers: Sequence[str]) -> str:
        """Compare values with what the HMI shows, and return what was compared, in words.

        Raises:
            MapDiffersError: One differs.
            ConfigError: An answer cannot be understood, or a way in which numbers stand was not
                compared.
        """
        ways = set()
        for answer in answers:
            key, _, shown = answer.partition("=")
            if key not in self._numbers:
                raise ConfigError(
                    tr("{answer!r} names no value of this map.", answer=answer),
                    remedy=tr("Write for example {key}=12.35.", key=next(iter(self._numbers))),
                )
            self._require_alike(key, shown)
            ways.add(_way(self._numbers[key]))
        for key in self.to_compare():
            if _way(self._numbers[key]) not in ways:
                raise ConfigError(
                    tr("{key} has another form and was not compared.", key=key),
                    remedy=tr("Give --shows {key}=... as well.", key=key),
                )
        return ", ".join(answers)

    def _require_alike(self, key: str, shown: str) -> None:
        text = shown.strip().replace(",", ".")
        try:
            value = decimal(text)
        except ValueError as error:
            raise ConfigError(
                tr("{shown!r} is not a number.", shown=shown),
                remedy=tr("Type what the HMI shows for {key}, in mm or degrees.", key=key),
            ) from error
        found = self.values.get(key, 0.0)
        # The HMI may round or cut off: its last digit may differ by one.
        allowed = 10.0 ** -len(text.partition(".")[2])
        if not value or not abs(found - value) <= allowed * (1 + 1e-6):
            raise MapDiffersError(
                tr(
                    "The HMI shows {shown} for {key}, the map finds {found:.4f}.",
                    shown=text,
                    key=key,
                    found=found,
                ),
                remedy=tr(
                    "The map is not confirmed. Compare address, type, word_order, scale and unit "
                    "with the PLC's register list; a 0 proves nothing."
                ),
            )


def place_rows(register_map: RegisterMap) -> list[list[str]]:
    """Return what stands where, every number given both ways."""
    rows = []
    for slot in register_map.slots.values():
        for name, number in slot.components.items():
            rows.append([f"{slot.tool}.{name}", number.place, _form(number)])
        if slot.defined is not None:
            rows.append([tr("{tool} defined", tool=slot.tool), slot.defined.place, ""])
    rows += [[f"flange.{name}", n.place, _form(n)] for name, n in register_map.flange.items()]
    if register_map.probe is not None:
        number = register_map.probe.number
        rows.append([tr("probe"), number.place, f"{register_map.probe.value:g}, {_form(number)}"])
    commit = register_map.commit
    named = (
        (tr("request"), commit.request),
        (tr("answer"), commit.answer),
        (tr("busy"), commit.busy),
        (tr("error"), commit.error),
        (tr("error code"), commit.error_code),
        (tr("tool number"), commit.tool_number),
        (tr("permit"), register_map.permit),
        (tr("selected tool"), register_map.selected),
    )
    rows += [[what, place.place, ""] for what, place in named if place is not None]
    rows += [
        [tr("input {number}", number=one.number), one.signal.place, one.name]
        for one in register_map.inputs.values()
    ]
    return rows


def _form(number: Number) -> str:
    words = [str(number.type)]
    if number.type.words > 1:
        words.append(tr("low word first") if number.low_word_first else tr("high word first"))
    if number.swapped_bytes:
        words.append(tr("bytes swapped"))
    if number.factor != 1:
        words.append(tr("times {factor:g}", factor=number.factor))
    return ", ".join(words)


def _way(number: Number) -> object:
    return number.type, number.low_word_first, number.swapped_bytes, number.factor
