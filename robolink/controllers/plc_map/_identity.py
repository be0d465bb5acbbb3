"""Who a PLC is that is reached by a map: a number that the map knows, or its address."""

from robolink.controllers.plc_map._registers import Registers
from robolink.model import Identity
from robolink.register_maps import RegisterMap


class IdentityReader:
    """Reads the machine's own number, where the map says where it stands."""

    def __init__(self, registers: Registers, register_map: RegisterMap) -> None:
        self._registers = registers
        self._place = register_map.device_id

    def read(self) -> Identity:
        """Return who it is.

        Raises:
            TransportError, RemoteProtocolError: The link failed, or the number does not stand
                still.
            RejectedError: The PLC has no such registers.
        """
        address, place = self._registers.identity, f"plc@{self._registers.place}"
        if self._place is None:
            return Identity(place, address, place)
        words = self._registers.read_twice(self._place.table, self._place.registers)
        if not any(words):
            # Zeroed by a watchdog, or the program has not started
            # (docs/reference/softmotion.md 4.1).
            return Identity(place, address, place, certain=False)
        return Identity(f"plc:{''.join(f'{word:04X}' for word in words)}", address, place)
