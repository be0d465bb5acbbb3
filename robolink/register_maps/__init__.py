"""Maps of a machine builder's own registers: where a PLC keeps its tool offsets.

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
from robolink.register_maps._drafts import MapDraft, draft_from_csv
from robolink.register_maps._loading import check_map, load_map
from robolink.register_maps._map import (
    ANGLES,
    COMPONENTS,
    LREAL_TOLERANCE,
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
    describe_place,
    span_of,
)

__all__ = [
    "ANGLES",
    "AllZero",
    "COMPONENTS",
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
    "RegisterMap",
    "RegisterTable",
    "RegisterWords",
    "Signal",
    "Word",
    "check_map",
    "compare",
    "compare_test",
    "confirm",
    "confirmation_of",
    "describe_place",
    "draft_from_csv",
    "load_map",
    "revoke",
    "span_of",
    "to_compare",
    "values_of",
]

if not TYPE_CHECKING:
    __getattr__ = old_names(__name__)
