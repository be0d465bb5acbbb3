"""A SoftMotion PLC in a virtual cell as a CANopen node, and the bus that leads to it."""

from typing import Final

from robolink.transport import MailboxLink
from robolink.transport.can.bus import CanLine
from robolink.transport.can.mailbox import CanopenMailboxLink
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.hosting.in_process.canopen_bus import SteppedCan
from robolink_simulators.soak.computer import VirtualProcess
from robolink_simulators.soak.plant.machine import WireTap
from robolink_simulators.soak.plant.softmotion import SoftMotionPlant

_NODE: Final = 5
_TIMEOUT_S: Final = 3.0


class CanopenPlant(SoftMotionPlant):
    """A PLC with its mailbox on CANopen; made from what :class:`SoftMotionPlant` is."""

    def __init__(self, clock: ManualClock, tap: WireTap, seed: int) -> None:
        super().__init__(clock, tap, seed)
        self._bus = SteppedCan(self.simulator, clock, node=_NODE)
        self._open: dict[int, MailboxLink] = {}

    def link(self) -> MailboxLink:
        """Plug an adapter in, and meet the node."""
        return self._met(start=True)

    def tapped(self, link: MailboxLink, process: VirtualProcess) -> MailboxLink:
        """See :meth:`SoftMotionPlant.tapped`."""
        self._open[process.number] = link
        return super().tapped(link, process)

    def hang_up(self, process: VirtualProcess) -> None:
        """The system closes the adapter of a process that died."""
        link = self._open.pop(process.number, None)
        if link is not None:
            link.close()

    def _met(self, *, start: bool) -> CanopenMailboxLink:
        link = CanopenMailboxLink(
            CanLine(self._bus.attach(), self.address),
            _NODE,
            lambda _timeout_s: self._met(start=False),
            identity=self.address,
            durable=True,
            timeout_s=_TIMEOUT_S,
            clock=self.clock,
        )
        try:
            link.meet(start=start)
        except BaseException:
            link.close()
            raise
        return link
