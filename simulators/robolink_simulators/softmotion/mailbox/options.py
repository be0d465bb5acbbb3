"""How a PLC's mailbox program and its fieldbus are set up, as named options.

Evidence marks as in docs/reference/softmotion.md: [D] vendor documentation, [U] unverified;
[project] what each PLC project chooses for itself.
"""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class MailboxOptions:
    """One PLC's mailbox.

    Attributes:
        profile: Which opcodes the program holds [project]; ``tools`` has no motion.
        unit_um: Micrometres per user unit of the axis group [project].
        word_order: How the program lays values of several words; anything but ``low_first``
            is a mistake that a client must notice (docs/reference/softmotion.md 4.4).
        program_cycle_us: Period of the task that the mailbox program runs in [project].
        exchange_us: What one exchange takes over a ``sim`` URL [ours].
        watchdog_ms: Silence after which the fieldbus zeroes what clients write; 0 never
            [D, the usual time U].
        registers: Where Modbus clients find response and slots [D]: input registers, or
            holding registers when the project ticks "writable".
        command: Modbus address of the command block [project].
        response: Modbus address of the response block [project].
        slots: Modbus address of tool slot 1 [project]; 0 puts the slots behind the response.
        snapshot_latched: Whether CANopen object 2101h stands still between snapshots, as the
            mailbox demands; a stack without that refreshes it in the middle of an upload [U].
        device_id: The number that this PLC drew once, up to 2**32 - 1; 0 draws one that no
            other has [ours]. A state file keeps what was drawn.
        identified: Whether the program has that number; an earlier one has zeros in its place.
    """

    profile: Literal["full", "tools"] = "full"
    unit_um: float = 1000.0
    word_order: Literal["low_first", "high_first", "pairs_swapped", "halves_swapped"] = "low_first"
    program_cycle_us: int = 4000
    exchange_us: int = 1000
    watchdog_ms: int = 0
    registers: Literal["input", "holding"] = "input"
    command: int = 0
    response: int = 0
    slots: int = 0
    snapshot_latched: bool = True
    device_id: int = 0
    identified: bool = True
