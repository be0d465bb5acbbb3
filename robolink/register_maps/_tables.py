"""The tables of a map file: keys and limits. Imported when one is loaded, for pydantic.

Fills in what ``[numbers]`` says for all, and turns units into mm and degrees. How a place is
written differs between registers, here, and symbols
(:mod:`robolink.register_maps._symbol_tables`).
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Annotated, Any, Final, Generic, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from robolink.files.toml import Problem
from robolink.messages import tr
from robolink.register_maps._map import (
    MapSlot,
    Number,
    RegisterMap,
    RegisterTable,
    RegisterWords,
    Signal,
    Word,
)
from robolink.register_maps._places import (
    ANGLES,
    COMPONENTS,
    AllZero,
    AnyMap,
    Commit,
    CommitKind,
    Input,
    MapProbe,
    NumberType,
    PlacedNumber,
    PlacedSignal,
    PlacedWord,
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


NumberKeysT = TypeVar("NumberKeysT", bound=Keys)
SignalKeysT = TypeVar("SignalKeysT", bound=Keys)
WordKeysT = TypeVar("WordKeysT", bound=Keys)


class MappedToolTable(Keys, Generic[NumberKeysT, SignalKeysT]):
    """One ``[[tools]]``: the components that the PLC has."""

    number: Annotated[int, Field(ge=1, le=15)]
    name: Line = ""
    x: NumberKeysT | None = None
    y: NumberKeysT | None = None
    z: NumberKeysT | None = None
    u: NumberKeysT | None = None
    v: NumberKeysT | None = None
    w: NumberKeysT | None = None
    defined: SignalKeysT | None = None


class FlangeTable(Keys, Generic[NumberKeysT]):
    """``[flange]``: where the flange is."""

    x: NumberKeysT
    y: NumberKeysT
    z: NumberKeysT
    u: NumberKeysT
    v: NumberKeysT | None = None
    w: NumberKeysT | None = None


class InputKeys(SignalKeys):
    """One ``[[inputs]]``."""

    number: Annotated[int, Field(ge=0, le=0xFFFF)]
    name: Line = ""


class _Handshake(Keys, Generic[SignalKeysT, WordKeysT]):
    busy: SignalKeysT | None = None
    error: SignalKeysT | None = None
    error_code: WordKeysT | None = None
    error_texts: dict[Annotated[str, Field(pattern="^[0-9]{1,5}$")], Line] = Field(
        default_factory=dict
    )
    tool_number: WordKeysT | None = None
    timeout_s: Seconds = 2.0


class CommitBitKeys(_Handshake[SignalKeysT, WordKeysT], Generic[SignalKeysT, WordKeysT]):
    """``kind = "commit_bit"``: trigger on, done comes, trigger off, done goes."""

    kind: Literal["commit_bit"]
    trigger: SignalKeysT
    done: SignalKeysT


class LevelKeys(_Handshake[SignalKeysT, WordKeysT], Generic[SignalKeysT, WordKeysT]):
    """``kind = "level"``: request stays on until the PLC acknowledges."""

    kind: Literal["level"]
    request: SignalKeysT
    acknowledge: SignalKeysT


class NoneKeys(Keys):
    """``kind = "none"``: written values take effect at once."""

    kind: Literal["none"]
    settle_s: Seconds = 0.2


class MapTables(Keys):
    """What every map file has at its top."""

    format: Literal["robolink/plc-map/1"] = Field(alias="schema")
    name: Line
    rotation: Literal["Rz(U) Ry(V) Rx(W)"] | None = None
    all_zero: Literal["refuse", "undefined", "tool"] = "refuse"
    largest_mm: Annotated[float, Field(gt=0, le=100_000)] = 2000.0


class MapFile(MapTables):
    """One whole map of registers."""

    model_config = ConfigDict(title="robolink PLC map")

    numbers: NumberDefaults = Field(default_factory=NumberDefaults)
    tools: Annotated[list[MappedToolTable[NumberKeys, SignalKeys]], Field(min_length=1)]
    commit: Annotated[
        CommitBitKeys[SignalKeys, WordKeys] | LevelKeys[SignalKeys, WordKeys] | NoneKeys,
        Field(discriminator="kind"),
    ]
    probe: ProbeKeys | None = None
    permit: SignalKeys | None = None
    selected: WordKeys | None = None
    device_id: WordsKeys | None = None
    flange: FlangeTable[NumberKeys] | None = None
    inputs: list[InputKeys] = Field(default_factory=list)


def keys_of(*tables: type[Keys]) -> list[str]:
    """Return all keys of some tables, used to suggest a correction."""
    return sorted(
        {field.alias or name for table in tables for name, field in table.model_fields.items()}
    )


KEYS: Final = keys_of(
    MapFile,
    NumberDefaults,
    ProbeKeys,
    WordsKeys,
    InputKeys,
    MappedToolTable,
    CommitBitKeys,
    LevelKeys,
    NoneKeys,
)
"""All keys of a map of registers."""


_LENGTHS: Final = {"mm": 1.0, "um": 0.001, "m": 1000.0, "inch": 25.4}
_ANGLES: Final = {"deg": 1.0, "rad": math.degrees(1.0)}


class Resolving(ABC):
    """Turns one file that pydantic accepted into a map.

    Attributes:
        problems: What it found missing or wrong on the way.
    """

    def __init__(self, file: Any) -> None:  # noqa: ANN401 - the tables of one kind of place
        self.problems: list[Problem] = []
        self._file = file

    def resolve(self, sha256: str) -> AnyMap | None:
        """Return the map; ``None``, with :attr:`problems`, when something is missing."""
        file = self._file
        slots = [self._slot(f"tools#{at}", keys) for at, keys in enumerate(file.tools, start=1)]
        found = {
            "name": file.name,
            "sha256": sha256,
            "slots": {slot.tool: slot for slot in slots},
            "commit": self._commit(file.commit),
            "probe": self._probe(),
            "permit": self._signal("permit", file.permit),
            "selected": self._word("selected", file.selected),
            "flange": self._components("flange", file.flange) if file.flange else {},
            "inputs": {
                keys.number: Input(keys.number, keys.name, signal)
                for at, keys in enumerate(file.inputs, start=1)
                if (signal := self._signal(f"inputs#{at}", keys)) is not None
            },
            "all_zero": AllZero(file.all_zero),
            "largest_mm": file.largest_mm,
        }
        made = self._made(found)
        return None if self.problems else made

    @abstractmethod
    def _made(self, found: dict[str, Any]) -> AnyMap:
        """Return the map of what is alike for all kinds of places."""

    @abstractmethod
    def _slot(self, path: str, keys: Any) -> Any:  # noqa: ANN401
        """Return where a tool is."""

    @abstractmethod
    def _placed(self, path: str, keys: Any, kind: NumberType, factor: float) -> PlacedNumber | None:  # noqa: ANN401
        """Return a number whose type and factor are known."""

    @abstractmethod
    def _signal(self, path: str, keys: Any) -> PlacedSignal | None:  # noqa: ANN401
        """Return a signal, ``None`` for none."""

    @abstractmethod
    def _word(self, path: str, keys: Any) -> PlacedWord | None:  # noqa: ANN401
        """Return a whole number, ``None`` for none."""

    def _components(self, path: str, keys: Any) -> dict[str, Any]:  # noqa: ANN401
        found: dict[str, Any] = {}
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
        if all(getattr(keys, name) is None for name in COMPONENTS):
            self._tell(path, tr("names no component: give at least one of x y z u v w"))
        return found

    def _probe(self) -> MapProbe[Any] | None:
        keys = self._file.probe
        if keys is None:
            return None
        if keys.unit is not None or keys.scale is not None:
            self._tell("probe", tr("is compared as it stands: take unit and scale out"))
        plain = keys.model_copy(update={"scale": 1.0, "unit": None})
        number = self._number("probe", plain, angle=None)
        return None if number is None else MapProbe(number, keys.value)

    def _number(self, path: str, keys: Any, *, angle: bool | None) -> PlacedNumber | None:  # noqa: ANN401
        """Return a number; ``angle`` is ``None`` for one that is neither length nor angle."""
        common = self._file.numbers
        type_name = keys.type or common.type
        if type_name is None:
            self._tell(f"{path}.type", tr("is missing, here and in [numbers]"))
            return None
        scale = common.scale if keys.scale is None else keys.scale
        if scale == 0:
            self._tell(f"{path}.scale", tr("must not be 0"))
            return None
        factor = scale * self._unit(path, keys, angle=angle)
        return self._placed(path, keys, NumberType(type_name), factor)

    def _unit(self, path: str, keys: Any, *, angle: bool | None) -> float:  # noqa: ANN401
        if angle is None:
            return 1.0
        common = self._file.numbers
        units: Mapping[str, float] = _ANGLES if angle else _LENGTHS
        unit = keys.unit or (common.angle_unit if angle else common.length_unit)
        if unit not in units:
            self._tell(f"{path}.unit", tr("must be one of {values}", values=", ".join(units)))
            return 1.0
        return units[unit]

    def _commit(self, keys: Any) -> Commit[Any, Any]:  # noqa: ANN401
        if isinstance(keys, NoneKeys):
            return Commit(settle_s=keys.settle_s)
        kind = CommitKind(keys.kind)
        asking, answering = HANDSHAKE_KEYS[kind]
        return Commit(
            kind,
            request=self._signal(f"commit.{asking}", getattr(keys, asking)),
            answer=self._signal(f"commit.{answering}", getattr(keys, answering)),
            busy=self._signal("commit.busy", keys.busy),
            error=self._signal("commit.error", keys.error),
            error_code=self._word("commit.error_code", keys.error_code),
            error_texts={int(number): text for number, text in keys.error_texts.items()},
            tool_number=self._word("commit.tool_number", keys.tool_number),
            timeout_s=keys.timeout_s,
        )

    def _tell(self, where: str, what: str) -> None:
        self.problems.append(Problem(where, what))


HANDSHAKE_KEYS: Final = {
    CommitKind.COMMIT_BIT: ("trigger", "done"),
    CommitKind.LEVEL: ("request", "acknowledge"),
}
"""What the file calls request and answer, by the kind of handshake."""


class RegisterResolving(Resolving):
    """The places of a map of registers."""

    def _made(self, found: dict[str, Any]) -> RegisterMap:
        keys = self._file.device_id
        number = keys and RegisterWords(RegisterTable(keys.table), keys.address, keys.words)
        return RegisterMap(**found, device_id=number)

    def _slot(self, path: str, keys: MappedToolTable[NumberKeys, SignalKeys]) -> MapSlot:
        defined = self._signal(f"{path}.defined", keys.defined)
        return MapSlot(keys.number, keys.name, self._components(path, keys), defined)

    def _placed(
        self, path: str, keys: NumberKeys, kind: NumberType, factor: float
    ) -> Number | None:
        common = self._file.numbers
        order = keys.word_order or common.word_order
        if kind.words > 1 and order is None:
            self._tell(f"{path}.word_order", tr("is missing, here and in [numbers]"))
            return None
        return Number(
            RegisterTable(keys.table or common.table),
            keys.address,
            kind,
            low_word_first=order == "low_first",
            swapped_bytes=(keys.byte_order or common.byte_order) == "little",
            factor=factor,
        )

    def _signal(self, path: str, keys: SignalKeys | None) -> Signal | None:  # noqa: ARG002 - alike
        return (
            None
            if keys is None
            else Signal(RegisterTable(keys.table), keys.address, keys.bit, keys.on, keys.off)
        )

    def _word(self, path: str, keys: WordKeys | None) -> Word | None:  # noqa: ARG002 - alike
        return None if keys is None else Word(RegisterTable(keys.table), keys.address)
