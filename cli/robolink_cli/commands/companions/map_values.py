"""The values that a map finds in a PLC, and where they stand."""

from typing import TYPE_CHECKING

from robolink.errors import RobolinkError
from robolink.messages import tr
from robolink.register_maps import COMPONENTS, MapValue, Number, RegisterMap, values_of
from robolink_cli.console.render import note, table

if TYPE_CHECKING:
    from robolink.controllers import PlcMapController


class MapValues:
    """What stands in the registers of the tools now; reads only.

    Attributes:
        found: By value, mm or degrees.
        unreadable: For each tool that cannot be read, why.
    """

    def __init__(self, controller: "PlcMapController") -> None:
        self._map = controller.register_map
        self.found: dict[MapValue, float] = {}
        self.unreadable: dict[int, str] = {}
        for tool in controller.tools.indices():
            try:
                offset = controller.tools.read(tool)
            except RobolinkError as error:
                self.unreadable[tool] = str(error)
                continue
            held = dict(zip(COMPONENTS, offset.components(), strict=True)) if offset else {}
            mapped = self._map.slots[tool].components
            self.found |= {MapValue(tool, name): held[name] for name in mapped if held}

    def payload(self) -> dict[str, object]:
        """Return it as plain JSON; lengths in mm, angles in degrees."""
        return {
            "name": self._map.name,
            "sha256": self._map.sha256,
            "values": {str(value): found for value, found in self.found.items()},
            "unreadable": {str(tool): why for tool, why in self.unreadable.items()},
        }

    def show(self) -> None:
        """Show it to a person who stands at the HMI."""
        rows = [
            [
                str(value),
                number.place,
                number.type,
                f"{self.found[value]:.4f}" if value in self.found else "-",
            ]
            for value, number in values_of(self._map).items()
        ]
        columns = (tr("tool"), tr("place"), tr("type"), tr("mm or deg"))
        table(tr("{name}: what the map finds", name=self._map.name), columns, rows)
        for why in self.unreadable.values():
            note(why)


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
