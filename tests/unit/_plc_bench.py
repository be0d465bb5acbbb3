"""A driver and a simulated PLC without a wire between them; time passes only in waits."""

from pathlib import Path

from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.plc import PlcSimulator
from robolink_simulators.plc.memory import OutsideError

from robolink.controllers import PlcMapController
from robolink.errors import RejectedError, TransportTimeoutError
from robolink.journal import memory_journal
from robolink.register_maps import RegisterTable, load_map
from robolink.testing import confirm_whole_map

EXAMPLES = Path("examples/plc-maps")
COMMIT_BIT = EXAMPLES / "commit-bit.toml"
LEVEL = EXAMPLES / "level-handshake.toml"
NO_HANDSHAKE = EXAMPLES / "no-handshake.toml"


class LocalClient:
    """Accesses the PLC's memory; ``fail`` names writes, by number, whose answer is lost."""

    def __init__(self, plc, identity):
        self.plc = plc
        self.identity = identity
        self.place = identity.partition("://")[2]
        self.clock = ManualClock()
        self.most_registers = 125
        self.lose = set()
        self.refuse = set()
        self.cut = False
        self._writes = 0

    def read_holding(self, address, count):
        return self._read(RegisterTable.HOLDING, address, count)

    def read_input(self, address, count):
        return self._read(RegisterTable.INPUT, address, count)

    def read_coils(self, address, count):
        return self._read(RegisterTable.COIL, address, count)

    def read_discrete(self, address, count):
        return self._read(RegisterTable.DISCRETE, address, count)

    def write_registers(self, address, values):
        self._write(RegisterTable.HOLDING, address, list(values))

    def write_coil(self, address, value):
        self._write(RegisterTable.COIL, address, [int(value)])

    def close(self):
        self.cut = True

    def _alive(self):
        if self.cut:
            raise TransportTimeoutError("the link is gone")
        self.plc.advance(self.clock.now_ns())

    def _read(self, table, address, count):
        self._alive()
        try:
            return tuple(self.plc.program.memory.read(table, range(address, address + count)))
        except OutsideError:
            raise RejectedError("illegal data address", code=2) from None

    def _write(self, table, address, values):
        self._alive()
        number, self._writes = self._writes, self._writes + 1
        if number in self.refuse:
            raise RejectedError("illegal data value", code=3)
        self.plc.program.memory.write(table, address, values)
        self.plc.writes.append((str(table), address, values))
        self.plc.program.written(self.plc.now_ns)
        if number in self.lose:
            self.cut = True
            raise TransportTimeoutError("the answer was lost")


class Bench:
    """One map, one PLC, and successive drivers with one record."""

    def __init__(self, path, *, identity, confirmed=True):
        self.map = load_map(Path(path))
        self.identity = identity
        self.plc = PlcSimulator(self.map, seed=3)
        self.program = self.plc.program
        if confirmed:
            with self.connect() as controller:
                confirm_whole_map(controller)

    def connect(self):
        """Return a driver that uses the bench's ``client``."""
        self.client = LocalClient(self.plc, self.identity)
        self.client.clock.advance(self.plc.now_ns / 1e9)
        outcomes = memory_journal(self.identity).log(self.identity)
        return PlcMapController(self.client, self.map, outcomes)
