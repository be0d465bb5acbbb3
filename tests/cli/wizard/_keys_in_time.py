"""Keys that come at times of a clock that is stepped, to a loop that gets to them late."""

from abc import ABC, abstractmethod

from robolink_cli.wizard.keys import KeyGate


class KeysInTime(ABC):
    """Sends keys, lets time pass, and tells which of them count."""

    now_s = 0.0

    @abstractmethod
    def look(self):
        """Let the thread look once."""

    @abstractmethod
    def send(self, text):
        """Send keys now."""

    @abstractmethod
    def taken(self):
        """Return each key that came, when, and when it surely had not."""

    @abstractmethod
    def quiet(self):
        """Return when surely nothing was there to be read, ``None`` while that is not known."""

    def until(self, at_s, every_s=0.005):
        """Let time pass, and the thread look so often; 0 for never."""
        while every_s and self.now_s + every_s <= at_s:
            self.now_s += every_s
            self.look()
        self.now_s = at_s

    def key(self, text, at_s, every_s=0.005):
        self.until(at_s, every_s)
        self.send(text)

    def counted(self):
        """Let the loop get to what came, late; return what counts, and whether a burst is told."""
        gate = KeyGate()
        found = [one.key for press in self.taken() for one in gate.press(*press)]
        quiet_s = self.quiet()
        assert quiet_s is not None
        found += [one.key for one in gate.due(quiet_s)]
        return found, gate.burst_ended(quiet_s)
