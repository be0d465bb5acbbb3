"""Maps of a machine builder's own registers or symbols: where a PLC keeps its tool offsets.

A map is a TOML file of the schema ``robolink/plc-map/1``; docs/plc-maps.md explains every key.
It is checked by pydantic, which is imported when a map is loaded and not before.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import old_names
from robolink.register_maps._comparisons import (
    ComparedValue,
    MapDiffersError,
    MapValue,
    OpenValue,
    compare,
    compare_test,
    to_compare,
    values_of,
)
from robolink.register_maps._confirmations import Confirmation, confirm, confirmation_of, revoke
from robolink.register_maps._drafts import MapDraft, component_of, draft_from_csv
from robolink.register_maps._loading import check_map, load_map, load_plc_map, load_symbol_map
from robolink.register_maps._map import (
    MapSlot,
    Number,
    RegisterMap,
    RegisterTable,
    RegisterWords,
    Signal,
    Word,
    describe_place,
    span_of,
)
from robolink.register_maps._places import (
    ANGLES,
    COMPONENTS,
    LREAL_TOLERANCE,
    AllZero,
    AnyMap,
    Cells,
    Commit,
    CommitKind,
    Input,
    MapProbe,
    NumberType,
    PlacedNumber,
    PlacedSignal,
    PlacedWord,
    PlcMap,
    ToolSlot,
)
from robolink.register_maps._symbols import (
    Step,
    SymbolCell,
    SymbolMap,
    SymbolNumber,
    SymbolSignal,
    SymbolSlot,
    SymbolWord,
    steps_in_words,
)

__all__ = [
    "ANGLES",
    "AllZero",
    "AnyMap",
    "COMPONENTS",
    "Cells",
    "Commit",
    "CommitKind",
    "ComparedValue",
    "Confirmation",
    "Input",
    "LREAL_TOLERANCE",
    "MapDiffersError",
    "MapDraft",
    "MapProbe",
    "MapSlot",
    "MapValue",
    "Number",
    "NumberType",
    "OpenValue",
    "PlacedNumber",
    "PlacedSignal",
    "PlacedWord",
    "PlcMap",
    "RegisterMap",
    "RegisterTable",
    "RegisterWords",
    "Signal",
    "Step",
    "SymbolCell",
    "SymbolMap",
    "SymbolNumber",
    "SymbolSignal",
    "SymbolSlot",
    "SymbolWord",
    "ToolSlot",
    "Word",
    "check_map",
    "compare",
    "compare_test",
    "component_of",
    "confirm",
    "confirmation_of",
    "describe_place",
    "draft_from_csv",
    "load_map",
    "load_plc_map",
    "load_symbol_map",
    "revoke",
    "span_of",
    "steps_in_words",
    "to_compare",
    "values_of",
]

if not TYPE_CHECKING:
    __getattr__ = old_names(__name__)
