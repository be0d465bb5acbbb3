"""The hours in which a plan may work, by the clock of the computer whose agent asks."""

import re
from dataclasses import dataclass
from datetime import datetime, time, timedelta
from typing import Final

_FORM: Final = re.compile(r"([01]\d|2[0-3]):([0-5]\d)-([01]\d|2[0-3]):([0-5]\d)")


@dataclass(frozen=True, slots=True)
class Window:
    """From one time of day to another, over midnight where the end comes first.

    Attributes:
        opens: When it opens, local time.
        closes: When it closes.
    """

    opens: time
    closes: time

    @classmethod
    def parse(cls, text: str) -> "Window":
        """Return the window that a text names.

        Raises:
            ValueError: It has another form than ``22:00-05:00``, or opens when it closes.
        """
        found = _FORM.fullmatch(text)
        if found is None or found[1] + found[2] == found[3] + found[4]:
            raise ValueError(text)
        return cls(time(int(found[1]), int(found[2])), time(int(found[3]), int(found[4])))

    def __str__(self) -> str:
        return f"{self.opens:%H:%M}-{self.closes:%H:%M}"

    def is_open(self, now: datetime) -> bool:
        """Return whether it is open at an instant.

        Args:
            now: With its zone; the zone is that of the plan's agent.
        """
        at = now.time()
        if self.opens < self.closes:
            return self.opens <= at < self.closes
        return at >= self.opens or at < self.closes

    def end_after(self, begun: datetime) -> datetime:
        """Return when it closes for what began at an instant, in the same zone.

        Args:
            begun: An instant at which it was open.
        """
        end = begun.replace(
            hour=self.closes.hour, minute=self.closes.minute, second=0, microsecond=0
        )
        return end if end > begun else end + timedelta(days=1)
