"""The far end of a mailbox over OPC UA, and the requests that it was asked."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final

from tests.unit._opcua_far_end import TYPES, FarEnd, far_end

_VALUE: Final = 13
"""Number of the attribute that is a variable's value (OPC 10000-6, annex A.1)."""


class OpcuaFarEnd:
    """Implements :class:`tests.contract._mailbox_far_ends.FarEnd`; tests share one.

    Attributes:
        url: For a link to its mailbox.
        requests: Kind and variables of each request of a client since the last ``clear()``.
    """

    def __init__(self, served: FarEnd) -> None:
        self.url = served.url()
        self.requests: list[tuple[str, ...]] = []
        self._served = served
        from asyncua.common.callback import CallbackType  # takes a second, so not for collection

        self._names = {node.nodeid: name for name, node in served.nodes.items()}
        for kind in (CallbackType.PreRead, CallbackType.PreWrite):
            served.server.subscribe_server_callback(kind, self._note)

    def _note(self, event: Any, _dispatcher: object) -> None:
        asked = event.request_params
        reads = hasattr(asked, "NodesToRead")
        of = asked.NodesToRead if reads else asked.NodesToWrite
        values = [one.NodeId for one in of if one.AttributeId == _VALUE]
        names = [self._names[node] for node in values if node in self._names]
        if event.is_external and names:
            self.requests.append(("read" if reads else "write", *names))

    def reset(self) -> None:
        """Put everything as it was, and forget the requests."""
        for name, (_, value, _) in TYPES.items():
            self.put(name, value)
        self.requests.clear()

    def put(self, name: str, value: object, kind: str = "") -> None:
        """Put any value into a variable, of another type too, which its own server refuses."""
        from asyncua import ua

        variant = ua.Variant(value, getattr(ua.VariantType, kind or TYPES[name][0]))
        node = self._served.server.iserver.aspace._nodes[self._served.nodes[name].nodeid]
        node.attributes[ua.AttributeIds.Value].value = ua.DataValue(variant)

    def put_response(self, words: Sequence[int]) -> None:
        self.put("response", [7, *words, 7])

    def put_slot(self, slot: int, words: Sequence[int]) -> None:
        self._put_slots(36 * (slot - 1), words)

    def put_device(self, low: int, high: int) -> None:
        self._put_slots(36 * 15, (low, high, low ^ 0xFFFF, high ^ 0xFFFF))

    def _put_slots(self, first: int, words: Sequence[int]) -> None:
        slots = list(self._served.value("slots"))
        slots[first : first + len(words)] = words
        self.put("slots", slots)

    def command(self) -> list[int]:
        return list(self._served.value("command"))

    def heartbeat(self) -> int:
        beat: int = self._served.value("heartbeat")
        return beat


@contextmanager
def opcua_server() -> Iterator[OpcuaFarEnd]:
    """Serve on loopback."""
    with far_end() as served:
        yield OpcuaFarEnd(served)
