"""Values of two moments in one, as a server shows or stores them that copies a part at a time.

What is no mixture has not been torn: a fault that finds one node, a single value, or nothing that
changed meanwhile has not happened, and waits for the next request.
"""

from typing import Any, Final

from robolink_simulators.faults import Fault, PlcFault
from robolink_simulators.hosting.fieldbus.opcua_symbols import ServedSymbols, SymbolValue

_TEARS: Final = frozenset({"TEAR_ARRAY", "TEAR_NODES", "TEAR_WRITE"})

Parts = tuple[Any, ...]


def place_in(fault: Fault | PlcFault, count: int) -> int:
    """Return where something of so many parts tears."""
    return count // 2 if fault.position is None else fault.position % max(1, count)


def mixed(fault: Fault | PlcFault, before: Parts, after: Parts) -> Parts | None:
    """Return the parts before the fault's place from one moment and the others from the next one.

    With an odd ``bit`` it is the other way round. ``None`` where the result is one of the moments.
    """
    middle = place_in(fault, len(before))
    first, rest = (after, before) if (fault.bit or 0) % 2 else (before, after)
    made = (*first[:middle], *rest[middle:])
    return None if made in (before, after) else made


def torn_answer(
    served: ServedSymbols, later: tuple[SymbolValue, ...]
) -> tuple[tuple[SymbolValue, ...], tuple[Fault | PlcFault, ...]]:
    """Return the values of an answer as it is torn, and the tears that did not happen.

    Args:
        served: What was read, with the faults that it meets; nothing for a write.
        later: The same variables some time later.
    """
    happened: list[Fault | PlcFault] = []

    def tear(fault: Fault | PlcFault | None, before: Parts, after: Parts) -> Parts:
        made = None if fault is None else mixed(fault, before, after)
        if fault is None or made is None:
            return before
        happened.append(fault)
        return made

    values = tuple(
        tear(served.meets("TEAR_ARRAY", place), before, after)
        if isinstance(before, tuple) and isinstance(after, tuple)
        else before
        for place, (before, after) in enumerate(zip(served.values, later, strict=True))
    )
    values = tear(served.meets("TEAR_NODES"), values, later)
    planned = dict.fromkeys(one for met in served.met for one in met if one.action.name in _TEARS)
    return values, tuple(one for one in planned if one not in happened)
