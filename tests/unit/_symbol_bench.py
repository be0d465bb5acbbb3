"""A driver and the variables of a PLC without a wire between them; time passes only in waits."""

from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.plc.memory import SymbolMemory
from robolink_simulators.plc.program import PlcProgram

from robolink.controllers import PlcMapController
from robolink.errors import RejectedError, TransportTimeoutError
from robolink.journal import memory_journal
from robolink.register_maps import load_symbol_map
from robolink.testing import confirm_whole_map


@dataclass(frozen=True)
class Facts:
    name: str
    kind: str
    lengths: tuple[int, ...] = ()
    fields: tuple[Any, ...] = ()
    readable: bool = True
    id: str = ""

    @property
    def type_name(self) -> str:
        return self.kind + "".join(f"[{length}]" for length in self.lengths)


class LocalSymbolClient:
    """Accesses the program's variables; ``lose`` names writes, by number, whose answer is lost."""

    def __init__(self, program, identity, clock):
        self.program, self.identity, self.clock = program, identity, clock
        self.place = identity.partition("://")[2]
        self.lose: set[int] = set()
        self.refuse: set[int] = set()
        self.read_only: set[str] = set()
        self.others: dict[str, Facts] = {}
        self.writes: list[tuple[str, Any]] = []
        self.reads = 0
        self.on_read = lambda number: None
        self.after_write = lambda number: None
        self.cut = False
        self._begun = 0

    def describe(self, node):
        if node in self.others:
            return self.others[node]
        one = self.program.memory.variables.get(node)
        if one is None:
            raise RejectedError(f"{node} is not known to the server", code=0x80340000)
        if isinstance(one.value, dict):
            fields = tuple(Facts(name, one.kinds[name]) for name in one.value)
            return Facts(node, "Structure", (), fields, id=node)
        lengths = (len(one.value),) if isinstance(one.value, list) else ()
        return Facts(node, one.kind, lengths, id=node)

    def read(self, nodes):
        self._alive()
        self.reads += 1
        self.on_read(self.reads)
        return tuple(deepcopy(self.program.memory.variables[node].value) for node in nodes)

    def write(self, node, value):
        self._alive()
        number, self._begun = self._begun, self._begun + 1
        if number in self.refuse:
            raise RejectedError("BadTypeMismatch", code=0x80740000)
        self.require_writable(node)
        held = self.program.memory.variables[node].value
        assert type(held) is type(value), (held, value)
        if isinstance(held, list):
            assert len(held) == len(value)
        if isinstance(held, dict):
            assert list(held) == list(value)
        self.program.memory.variables[node].value = deepcopy(value)
        self.writes.append((node.rpartition(".")[2], value))
        self.program.written(self.clock.now_ns())
        self.after_write(number)
        if number in self.lose:
            self.cut = True
            raise TransportTimeoutError("the answer was lost")

    def require_writable(self, node):
        if node in self.read_only:
            raise RejectedError(f"{node} cannot be written")

    def close(self):
        self.cut = True

    def _alive(self):
        if self.cut:
            raise TransportTimeoutError("the link is gone")
        self.program.advance(self.clock.now_ns())


class SymbolBench:
    """One map of symbols, one PLC, and successive drivers with one record."""

    def __init__(self, path, *, identity, confirmed=True):
        self.map = load_symbol_map(Path(path))
        self.identity = identity
        self.clock = ManualClock()
        self.program = PlcProgram(self.map, SymbolMemory(self.map), seed=3)
        if confirmed:
            with self.connect() as controller:
                confirm_whole_map(controller)

    def connect(self):
        """Return a driver that uses the bench's ``client``."""
        self.client = LocalSymbolClient(self.program, self.identity, self.clock)
        outcomes = memory_journal(self.identity).log(self.identity)
        return PlcMapController(self.client, self.map, outcomes)

    def variable(self, name):
        """Return the variable of a node that ends with ``name``."""
        (found,) = (
            one
            for node, one in self.program.memory.variables.items()
            if node.rpartition(".")[2] == name
        )
        return found

    def node(self, name):
        (found,) = (it for it in self.program.memory.variables if it.rpartition(".")[2] == name)
        return found
