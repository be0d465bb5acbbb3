"""What happens to a simulated machine some time from now."""

from collections.abc import Callable

Act = Callable[[], None]


class PlannedActs:
    """Acts, each at its own instant."""

    def __init__(self) -> None:
        self._planned: list[tuple[int, Act]] = []

    def plan_at(self, at_ns: int, act: Act) -> None:
        """Have something done at an instant."""
        self._planned.append((at_ns, act))

    def next_change(self) -> int | None:
        """Return when the next one is due."""
        return min(at_ns for at_ns, _ in self._planned) if self._planned else None

    def carry_out(self, now_ns: int) -> None:
        """Do what is due by now."""
        if not self._planned:
            return
        due = [act for at_ns, act in self._planned if at_ns <= now_ns]
        self._planned = [plan for plan in self._planned if plan[0] > now_ns]
        for act in due:
            act()

    def forget(self) -> None:
        """Plan nothing any more."""
        self._planned.clear()
