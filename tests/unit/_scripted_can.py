"""A CANopen node that is a function, on a fake bus."""

import struct

import can

NODE = 5
IDENTITY = "softmotion+can://desk?node=5"
SDO_ASK, SDO_ANSWER = 0x600 + NODE, 0x580 + NODE
TPDO1, RPDO1, HEARTBEAT = 0x180 + NODE, 0x200 + NODE, 0x700 + NODE


class FakeClock:
    def __init__(self):
        self.time_ns = 0

    def now_ns(self):
        return self.time_ns

    def sleep(self, seconds):
        self.time_ns += round(seconds * 1e9)


class ScriptedBus:
    """Hands each sent frame to ``answer``, which returns (identifier, data) frames."""

    def __init__(self, clock, answer):
        self.clock = clock
        self.answer = answer
        self.sent = []
        self.coming = []
        self.late = []
        self.failure = None

    def send(self, message, timeout=None):
        if self.failure:
            raise self.failure
        self.sent.append((message.arbitration_id, bytes(message.data)))
        self.hear(*self.answer(message.arbitration_id, bytes(message.data)))

    def hear(self, *frames, **flags):
        for identifier, data in frames:
            self.coming.append(
                can.Message(arbitration_id=identifier, data=data, is_extended_id=False, **flags)
            )

    def recv(self, timeout):
        if self.failure:
            raise self.failure
        if self.coming:
            return self.coming.pop(0)
        self.clock.sleep(timeout)
        if timeout:
            self.hear(*self.late)
            self.late = []
        return None

    def shutdown(self):
        self.failure = can.CanOperationError("the bus is shut down")


def expedited(index, subindex, value):
    return struct.pack("<BHBI", 0x4B, index, subindex, value)


def node_with(heartbeat_ms, more=lambda data: ()):
    """Answer the question for the heartbeat time; leave the rest to ``more``."""

    def answer(identifier, data):
        if identifier == SDO_ASK and data[:4] == b"\x40\x17\x10\x00":
            return [(SDO_ANSWER, expedited(0x1017, 0, heartbeat_ms))]
        return more(data) if identifier == SDO_ASK else ()

    return answer
