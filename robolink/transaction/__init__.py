"""Tool changes: all or none, restored at most once, recoverable."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import old_names
from robolink.transaction._change import ToolChange, Wanted, change_tools
from robolink.transaction._changed_since import (
    ChangedSince,
    changed_since,
    last_proof,
    tools_changed_since,
)
from robolink.transaction._orders import (
    LONGEST_ORDER,
    Describe,
    DoneOrder,
    Order,
    carrying_out,
    finish_order,
    order_on_record,
    plain_result,
    require_order_id,
)
from robolink.transaction._put_back import PutBack, Step
from robolink.transaction._settling import Recovery, Settler, look, recover
from robolink.transaction._undo import (
    Undone,
    UndoPlan,
    earlier_corrections,
    id_of_change,
    plan_undo,
    undo,
)

__all__ = [
    "ChangedSince",
    "Describe",
    "DoneOrder",
    "LONGEST_ORDER",
    "Order",
    "PutBack",
    "Recovery",
    "Settler",
    "Step",
    "ToolChange",
    "UndoPlan",
    "Undone",
    "Wanted",
    "carrying_out",
    "change_tools",
    "changed_since",
    "earlier_corrections",
    "finish_order",
    "id_of_change",
    "last_proof",
    "look",
    "order_on_record",
    "plain_result",
    "plan_undo",
    "recover",
    "require_order_id",
    "tools_changed_since",
    "undo",
]

if not TYPE_CHECKING:
    __getattr__ = old_names(__name__)
