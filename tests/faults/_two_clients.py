"""A controller that accepts two logins at once, which no EPSON controller does."""

from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.remote.link import EpsonServerLink

from robolink.protocols.epson_text import BadRequest, Request


class SharedSimulator(EpsonSimulator):
    """Without the rule of one client, only the lease keeps two operators apart."""

    def take(self, link: EpsonServerLink, event: Request | BadRequest) -> None:
        """Serve a client as the logged-in one, if it has logged in."""
        self._slot.client = link if link in self._logged_in else None
        super().take(link, event)
        self._logged_in.discard(link)
        if self._slot.client is link:
            self._logged_in.add(link)

    @property
    def _logged_in(self) -> set[EpsonServerLink]:
        links: set[EpsonServerLink] = self.__dict__.setdefault("_all_logged_in", set())
        return links
