"""Bits that switch back by themselves: ``On 11, 0.5`` (docs/reference/spel.md 8)."""

from robolink_simulators.epson.memory.bits import BitBank


class TimedBits:
    """Remembers which bit changes when."""

    __slots__ = ("_planned",)

    def __init__(self) -> None:
        self._planned: list[tuple[int, BitBank, int, bool]] = []

    def plan(self, at_ns: int, bank: BitBank, number: int, on: bool) -> None:
        """Switch a bit later; what was planned for it before is forgotten (assumed)."""
        self.forget(bank, number)
        self._planned.append((at_ns, bank, number, on))

    def forget(self, bank: BitBank, number: int) -> None:
        """Plan nothing for a bit any more: somebody has switched it."""
        self._planned = [p for p in self._planned if p[1] is not bank or p[2] != number]

    def clear(self) -> None:
        """Plan nothing any more."""
        self._planned.clear()

    def next_change(self) -> int | None:
        """Return when the next bit changes."""
        return min(at_ns for at_ns, *_ in self._planned) if self._planned else None

    def advance(self, now_ns: int) -> None:
        """Switch what is due by now, in order."""
        if not self._planned:
            return
        due = sorted((p for p in self._planned if p[0] <= now_ns), key=lambda p: p[0])
        self._planned = [p for p in self._planned if p[0] > now_ns]
        for _, bank, number, on in due:
            bank.set(number, on)
