"""Maps of a machine builder's own registers: where a PLC keeps its tool offsets.

A map is a TOML file of the schema ``robolink/plc-map/1``; docs/plc-maps.md explains every key.
It is checked by pydantic, which is imported when a map is loaded and not before.
"""

from robolink.files.toml import Problem as Problem
from robolink.register_maps._comparisons import ComparedValue as ComparedValue
from robolink.register_maps._comparisons import MapDiffersError as MapDiffersError
from robolink.register_maps._comparisons import MapValue as MapValue
from robolink.register_maps._comparisons import OpenValue as OpenValue
from robolink.register_maps._comparisons import compare as compare
from robolink.register_maps._comparisons import compare_test as compare_test
from robolink.register_maps._comparisons import to_compare as to_compare
from robolink.register_maps._comparisons import values_of as values_of
from robolink.register_maps._confirmations import Confirmation as Confirmation
from robolink.register_maps._confirmations import confirm as confirm
from robolink.register_maps._confirmations import confirmation_of as confirmation_of
from robolink.register_maps._confirmations import revoke as revoke
from robolink.register_maps._drafts import MapDraft as MapDraft
from robolink.register_maps._drafts import draft_from_csv as draft_from_csv
from robolink.register_maps._loading import check_map as check_map
from robolink.register_maps._loading import load_map as load_map
from robolink.register_maps._map import ANGLES as ANGLES
from robolink.register_maps._map import COMPONENTS as COMPONENTS
from robolink.register_maps._map import AllZero as AllZero
from robolink.register_maps._map import Commit as Commit
from robolink.register_maps._map import CommitKind as CommitKind
from robolink.register_maps._map import Input as Input
from robolink.register_maps._map import MapProbe as MapProbe
from robolink.register_maps._map import MapSlot as MapSlot
from robolink.register_maps._map import RegisterMap as RegisterMap
from robolink.register_maps._map import span_of as span_of
from robolink.register_maps._numbers import LREAL_TOLERANCE as LREAL_TOLERANCE
from robolink.register_maps._numbers import Number as Number
from robolink.register_maps._numbers import NumberType as NumberType
from robolink.register_maps._places import RegisterTable as RegisterTable
from robolink.register_maps._places import RegisterWords as RegisterWords
from robolink.register_maps._places import Signal as Signal
from robolink.register_maps._places import Word as Word
from robolink.register_maps._places import describe_place as describe_place
