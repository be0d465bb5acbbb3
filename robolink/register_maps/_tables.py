"""The tables of a map file: keys and limits. Imported when one is loaded, for pydantic.

Fills in what ``[numbers]`` says for all, and turns units into mm and degrees.
"""

import math
from collections.abc import Mapping
from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from robolink.files.toml import Problem
from robolink.messages import tr
from robolink.register_maps._map import (
    ANGLES,
    COMPONENTS,
    AllZero,
    Commit,
    CommitKind,
    Input,
    MapProbe,
    MapSlot,
    Number,
    NumberType,
    RegisterMap,
    RegisterTable,
    RegisterWords,
    Signal,
    Word,
)

Line = Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f-\x9f]*$")]
"""One line for people. No control characters: they would reach a terminal."""

Address = Annotated[int, Field(ge=0, le=0xFFFF)]
RegisterValue = Annotated[int, Field(ge=0, le=0xFFFF)]
Seconds = Annotated[float, Field(gt=0, le=60)]

TypeName = Literal["int16", "uint16", "int32", "uint32", "REAL", "LREAL"]
TableName = Literal["holding", "input"]
AnyTable = Literal["holding", "input", "coil", "discrete"]
WordOrder = Literal["low_first", "high_first"]
ByteOrder = Literal["big", "little"]
LengthUnit = Literal["mm", "um", "m", "inch"]
AngleUnit = Literal["deg", "rad"]


class Keys(BaseModel):
    """What all tables share."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False, hide_input_in_errors=True
    )


class NumberDefaults(Keys):
    """``[numbers]``: applies to every number that does not say otherwise."""

    table: TableName = "holding"
    type: TypeName | None = None
    word_order: WordOrder | None = None
    byte_order: ByteOrder = "big"
    scale: float = 1.0
    length_unit: LengthUnit = "mm"
    angle_unit: AngleUnit = "deg"


class NumberKeys(Keys):
    """One number: value = register times scale, in unit."""

    address: Address
    table: TableName | None = None
    type: TypeName | None = None
    word_order: WordOrder | None = None
    byte_order: ByteOrder | None = None
    scale: float | None = None
    unit: LengthUnit | AngleUnit | None = None


class ProbeKeys(NumberKeys):
    """``[probe]``: a constant, compared before any value is believed; in no unit."""

    value: float


class SignalKeys(Keys):
    """A coil, a discrete input, one bit of a register, or a whole register."""

    table: AnyTable
    address: Address
    bit: Annotated[int, Field(ge=0, le=15)] | None = None
    on: RegisterValue = 1
    off: RegisterValue = 0


class WordKeys(Keys):
    """A register with a whole number."""

    address: Address
    table: TableName = "holding"


class WordsKeys(WordKeys):
    """``[device_id]``: neighbouring registers that identify this machine."""

    words: Annotated[int, Field(ge=1, le=8)] = 2


class ToolKeys(Keys):
    """One ``[[tools]]``: the components that the PLC has."""

    number: Annotated[int, Field(ge=1, le=15)]
    name: Line = ""
    x: NumberKeys | None = None
    y: NumberKeys | None = None
    z: NumberKeys | None = None
    u: NumberKeys | None = None
    v: NumberKeys | None = None
    w: NumberKeys | None = None
    defined: SignalKeys | None = None


class FlangeKeys(Keys):
    """``[flange]``: where the flange is."""

    x: NumberKeys
    y: NumberKeys
    z: NumberKeys
    u: NumberKeys
    v: NumberKeys | None = None
    w: NumberKeys | None = None


class InputKeys(SignalKeys):
    """One ``[[inputs]]``."""

    number: Annotated[int, Field(ge=0, le=0xFFFF)]
    name: Line = ""


class _Handshake(Keys):
    busy: SignalKeys | None = None
    error: SignalKeys | None = None
    error_code: WordKeys | None = None
    error_texts: dict[Annotated[str, Field(pattern="^[0-9]{1,5}$")], Line] = Field(
        default_factory=dict
    )
    tool_number: WordKeys | None = None
    timeout_s: Seconds = 2.0


class CommitBitKeys(_Handshake):
    """``kind = "commit_bit"``: trigger on, done comes, trigger off, done goes."""

    kind: Literal["commit_bit"]
    trigger: SignalKeys
    done: SignalKeys


class LevelKeys(_Handshake):
    """``kind = "level"``: request stays on until the PLC acknowledges."""

    kind: Literal["level"]
    request: SignalKeys
    acknowledge: SignalKeys


class NoneKeys(Keys):
    """``kind = "none"``: written values take effect at once."""

    kind: Literal["none"]
    settle_s: Seconds = 0.2


class MapFile(Keys):
    """One whole map."""

    model_config = ConfigDict(title="robolink PLC map")

    format: Literal["robolink/plc-map/1"] = Field(alias="schema")
    name: Line
    rotation: Literal["Rz(U) Ry(V) Rx(W)"] | None = None
    all_zero: Literal["refuse", "undefined", "tool"] = "refuse"
    largest_mm: Annotated[float, Field(gt=0, le=100_000)] = 2000.0
    numbers: NumberDefaults = Field(default_factory=NumberDefaults)
    tools: Annotated[list[ToolKeys], Field(min_length=1)]
    commit: Annotated[CommitBitKeys | LevelKeys | NoneKeys, Field(discriminator="kind")]
    probe: ProbeKeys | None = None
    permit: SignalKeys | None = None
    selected: WordKeys | None = None
    device_id: WordsKeys | None = None
    flange: FlangeKeys | None = None
    inputs: list[InputKeys] = Field(default_factory=list)


KEYS: Final = {
    field.alias or name
    for table in (
        MapFile,
        NumberDefaults,
        ProbeKeys,
        WordsKeys,
        InputKeys,
        ToolKeys,
        CommitBitKeys,
        LevelKeys,
        NoneKeys,
    )
    for name, field in table.model_fields.items()
}
"""All keys of all tables, used to suggest a correction."""


_LENGTHS: Final = {"mm": 1.0, "um": 0.001, "m": 1000.0, "inch": 25.4}
_ANGLES: Final = {"deg": 1.0, "rad": math.degrees(1.0)}


class Resolving:
    """Turns one file that pydantic accepted into a map.

    Attributes:
        problems: What it found missing or wrong on the way.
    """

    def __init__(self, file: MapFile) -> None:
        self.problems: list[Problem] = []
        self._file = file

    def resolve(self, sha256: str) -> RegisterMap | None:
        """Return the map; ``None``, with :attr:`problems`, when something is missing."""
        file = self._file
        slots = [self._slot(number, keys) for number, keys in enumerate(file.tools, start=1)]
        flange = self._components("flange", file.flange) if file.flange else {}
        probe = self._probe()
        if self.problems:
            return None
        return RegisterMap(
            name=file.name,
            sha256=sha256,
            slots={slot.tool: slot for slot in slots},
            commit=_commit(file.commit),
            probe=probe,
            permit=_signal(file.permit),
            selected=_word(file.selected),
            device_id=_words(file.device_id),
            flange=flange,
            inputs={
                keys.number: Input(keys.number, keys.name, _some_signal(keys))
                for keys in file.inputs
            },
            all_zero=AllZero(file.all_zero),
            largest_mm=file.largest_mm,
        )

    def _slot(self, position: int, keys: ToolKeys) -> MapSlot:
        path = f"tools#{position}"
        components = self._components(path, keys)
        if not components:
            self._tell(path, tr("names no component: give at least one of x y z u v w"))
        return MapSlot(keys.number, keys.name, components, _signal(keys.defined))

    def _components(self, path: str, keys: ToolKeys | FlangeKeys) -> dict[str, Number]:
        found: dict[str, Number] = {}
        for name in COMPONENTS:
            given = getattr(keys, name)
            if given is not None:
                number = self._number(f"{path}.{name}", given, angle=name in ANGLES)
                if number is not None:
                    found[name] = number
        if self._file.rotation is None and {"v", "w"} & set(found):
            self._tell(
                path,
                tr(
                    'has V or W: state rotation = "Rz(U) Ry(V) Rx(W)" at the top of the map, if '
                    "the PLC means them so"
                ),
            )
        return found

    def _probe(self) -> MapProbe | None:
        keys = self._file.probe
        if keys is None:
            return None
        if keys.unit is not None or keys.scale is not None:
            self._tell("probe", tr("is compared as it stands: take unit and scale out"))
        plain = keys.model_copy(update={"scale": 1.0, "unit": None})
        number = self._number("probe", plain, angle=None)
        return None if number is None else MapProbe(number, keys.value)

    def _number(self, path: str, keys: NumberKeys, *, angle: bool | None) -> Number | None:
        """Return a number; ``angle`` is ``None`` for one that is neither length nor angle."""
        common = self._file.numbers
        type_name = keys.type or common.type
        order = keys.word_order or common.word_order
        if type_name is None:
            self._tell(f"{path}.type", tr("is missing, here and in [numbers]"))
            return None
        kind = NumberType(type_name)
        if kind.words > 1 and order is None:
            self._tell(f"{path}.word_order", tr("is missing, here and in [numbers]"))
            return None
        scale = common.scale if keys.scale is None else keys.scale
        if scale == 0:
            self._tell(f"{path}.scale", tr("must not be 0"))
            return None
        return Number(
            RegisterTable(keys.table or common.table),
            keys.address,
            kind,
            low_word_first=order == "low_first",
            swapped_bytes=(keys.byte_order or common.byte_order) == "little",
            factor=scale * self._unit(path, keys, angle=angle),
        )

    def _unit(self, path: str, keys: NumberKeys, *, angle: bool | None) -> float:
        if angle is None:
            return 1.0
        common = self._file.numbers
        units: Mapping[str, float] = _ANGLES if angle else _LENGTHS
        unit = keys.unit or (common.angle_unit if angle else common.length_unit)
        if unit not in units:
            self._tell(f"{path}.unit", tr("must be one of {values}", values=", ".join(units)))
            return 1.0
        return units[unit]

    def _tell(self, where: str, what: str) -> None:
        self.problems.append(Problem(where, what))


def _commit(keys: CommitBitKeys | LevelKeys | NoneKeys) -> Commit:
    if isinstance(keys, NoneKeys):
        return Commit(settle_s=keys.settle_s)
    if isinstance(keys, CommitBitKeys):
        request, answer = keys.trigger, keys.done
    else:
        request, answer = keys.request, keys.acknowledge
    return Commit(
        CommitKind(keys.kind),
        request=_signal(request),
        answer=_signal(answer),
        busy=_signal(keys.busy),
        error=_signal(keys.error),
        error_code=_word(keys.error_code),
        error_texts={int(number): text for number, text in keys.error_texts.items()},
        tool_number=_word(keys.tool_number),
        timeout_s=keys.timeout_s,
    )


def _signal(keys: SignalKeys | None) -> Signal | None:
    return None if keys is None else _some_signal(keys)


def _some_signal(keys: SignalKeys) -> Signal:
    return Signal(RegisterTable(keys.table), keys.address, keys.bit, keys.on, keys.off)


def _word(keys: WordKeys | None) -> Word | None:
    return None if keys is None else Word(RegisterTable(keys.table), keys.address)


def _words(keys: WordsKeys | None) -> RegisterWords | None:
    return (
        None if keys is None else RegisterWords(RegisterTable(keys.table), keys.address, keys.words)
    )
