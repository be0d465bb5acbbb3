"""A Modbus server that is a list of answers, on a fake line."""

from pymodbus.framer import FramerRTU, FramerSocket
from pymodbus.pdu import DecodePDU

from robolink.errors import TransportClosedError, TransportTimeoutError

IDENTITY = "plc+modbus-tcp://192.0.2.1:502"


class FakeClock:
    def __init__(self):
        self.time_ns = 0

    def now_ns(self):
        return self.time_ns

    def sleep(self, seconds):
        self.time_ns += max(0, round(seconds * 1e9))


class ScriptedLine:
    """A transport that answers the nth frame by the nth step of a script.

    A step takes the frame and returns pieces; a piece is bytes, or (seconds, bytes) for later.
    """

    identity = url = IDENTITY
    place = IDENTITY.partition("://")[2]
    durable = True

    def __init__(self, *steps):
        self.clock = FakeClock()
        self.steps = list(steps)
        self.sent = []
        self.sent_at_ns = []
        self.coming = []
        self.closed = False

    def send(self, data, *, deadline, secret=False):
        self._require_open()
        self.sent.append(data)
        self.sent_at_ns.append(self.clock.time_ns)
        for piece in self.steps.pop(0)(data) if self.steps else ():
            after_s, found = piece if isinstance(piece, tuple) else (0, piece)
            self.coming.append((self.clock.time_ns + round(after_s * 1e9), found))
        self.coming.sort(key=lambda piece: piece[0])

    def receive(self, *, deadline):
        self._require_open()
        if not self.coming or self.coming[0][0] > deadline.at_ns:
            self.clock.time_ns = deadline.at_ns
            raise TransportTimeoutError("silence")
        at_ns, data = self.coming.pop(0)
        self.clock.time_ns = max(self.clock.time_ns, at_ns)
        return data

    def receive_waiting(self):
        self._require_open()
        due = [data for at_ns, data in self.coming if at_ns <= self.clock.time_ns]
        self.coming = self.coming[len(due) :]
        return b"".join(due) if due else None

    def wait_readable(self, *, deadline):
        return bool(self.coming)

    def close(self):
        self.closed = True

    def _require_open(self):
        if self.closed:
            raise TransportClosedError("closed")


def tcp(payload, transaction, unit=255):
    return FramerSocket(DecodePDU(False)).encode(payload, unit, transaction)


def rtu(payload, unit=1):
    return FramerRTU(DecodePDU(False)).encode(payload, unit, 0)


def words(*values, function=4):
    body = b"".join(value.to_bytes(2, "big") for value in values)
    return bytes([function, len(body)]) + body
