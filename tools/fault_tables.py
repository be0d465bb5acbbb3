"""The tables of docs/fault-plans.md, made from the vocabulary itself.

``python -m tools.fault_tables`` prints them.
"""

import ast
import inspect
import re
import sys
from types import ModuleType
from typing import Final

from robolink_simulators.faults import fieldbus, stream
from robolink_simulators.faults.links import (
    EPSON_LINKS,
    MAILBOX_LINKS,
    PLC_LINKS,
    AnyAction,
    LinkKind,
    links_of,
)

_TABLES: Final = (
    ("## Faults of an EPSON, and of a PLC with a map", stream, stream.FaultAction),
    ("## Faults of a PLC with a mailbox", fieldbus, fieldbus.PlcFaultAction),
)
_CALLED: Final = {
    EPSON_LINKS | PLC_LINKS: "all",
    MAILBOX_LINKS: "all",
    EPSON_LINKS: "EPSON",
}


def tables() -> str:
    """Return both tables, each under its heading."""
    parts = []
    for heading, module, family in _TABLES:
        said = _sentences(module, family.__name__)
        rows = [_row(action, said[action.name]) for action in family]
        parts.append("\n".join((heading, "", "| fault | what goes wrong | on |", _RULE, *rows)))
    return "\n\n".join(parts) + "\n"


_RULE: Final = "|---|---|---|"


def _row(action: AnyAction, sentence: str) -> str:
    return f"| `{action.name.lower()}` | {sentence} | {_where(links_of(action))} |"


def _where(links: frozenset[LinkKind]) -> str:
    if links in _CALLED:
        return _CALLED[links]
    of_mailbox = links <= MAILBOX_LINKS
    return ", ".join(
        sorted(f"`{kind.partition('+')[2] if of_mailbox else kind}`" for kind in links)
    )


def _sentences(module: ModuleType, family: str) -> dict[str, str]:
    """Return what is written under each member of a vocabulary."""
    tree = ast.parse(inspect.getsource(module))
    body = next(it.body for it in tree.body if isinstance(it, ast.ClassDef) and it.name == family)
    said, name = {}, ""
    for node in body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            name = node.targets[0].id
        elif name and isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            said[name] = re.sub(r"\s+", " ", str(node.value.value)).strip().replace("``", "`")
    return said


if __name__ == "__main__":
    sys.stdout.write(tables())
