"""The tables of a map file: keys and limits. Imported when one is loaded, for pydantic."""

from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

Line = Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f-\x9f]*$")]
"""One line for people. No control characters: they would reach a terminal."""

Address = Annotated[int, Field(ge=0, le=0xFFFF)]
RegisterValue = Annotated[int, Field(ge=0, le=0xFFFF)]
Seconds = Annotated[float, Field(gt=0, le=60)]

TypeName = Literal["int16", "uint16", "int32", "uint32", "REAL", "LREAL"]
RegisterTable = Literal["holding", "input"]
AnyTable = Literal["holding", "input", "coil", "discrete"]
WordOrder = Literal["low_first", "high_first"]
ByteOrder = Literal["big", "little"]
LengthUnit = Literal["mm", "um", "m", "inch"]
AngleUnit = Literal["deg", "rad"]


class Keys(BaseModel):
    """What all tables have in common."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False, hide_input_in_errors=True
    )


class NumberDefaults(Keys):
    """``[numbers]``: what holds for every number that does not say otherwise."""

    table: RegisterTable = "holding"
    type: TypeName | None = None
    word_order: WordOrder | None = None
    byte_order: ByteOrder = "big"
    scale: float = 1.0
    length_unit: LengthUnit = "mm"
    angle_unit: AngleUnit = "deg"


class NumberKeys(Keys):
    """One number: value = register times scale, in unit."""

    address: Address
    table: RegisterTable | None = None
    type: TypeName | None = None
    word_order: WordOrder | None = None
    byte_order: ByteOrder | None = None
    scale: float | None = None
    unit: LengthUnit | AngleUnit | None = None


class ProbeKeys(NumberKeys):
    """``[probe]``: a constant, compared before anything is believed; in no unit."""

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
    table: RegisterTable = "holding"


class WordsKeys(WordKeys):
    """``[device_id]``: registers in a row that tell this machine from every other one."""

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
    """``kind = "none"``: what is written counts."""

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
"""Every key of every table, for a guess at what was meant."""
