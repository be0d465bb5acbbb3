"""The connections that a controller has, whoever of them is logged in."""

from robolink_simulators.epson.remote.link import EpsonServerLink


class OpenLinks:
    """Holds connections until nothing will happen on them any more."""

    __slots__ = ("_links",)

    def __init__(self) -> None:
        self._links: list[EpsonServerLink] = []

    @property
    def settled(self) -> bool:
        """Whether none has ended, of which something may still be on its way."""
        for link in self._links:  # noqa: SIM110 - asked in every exchange: a generator costs more
            if link.over:
                return False
        return True

    def add(self, link: EpsonServerLink) -> None:
        """Hold one more."""
        self._links.append(link)

    def next_change(self) -> int | None:
        """Return when something happens on one of them by itself, if ever."""
        first = None
        for link in self._links:
            change = link.next_change()
            if change is not None and (first is None or change < first):
                first = change
        return first

    def supervise(self, now_ns: int) -> None:
        """Keep their time-outs, and forget those that have ended."""
        for link in self._links:
            link.supervise(now_ns)
        self._links = [link for link in self._links if not link.drained]

    def cut(self) -> None:
        """End all of them from the controller's side."""
        for link in self._links:
            link.cut()

    def push(self, data: bytes) -> None:
        """Send every client bytes that nobody asked for (F10)."""
        for link in self._links:
            link.push(data)
