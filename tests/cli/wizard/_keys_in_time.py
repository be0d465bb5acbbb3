"""Keys at times of a stepped clock, read by a loop that runs late."""

from abc import ABC, abstractmethod

from robolink_cli.wizard.keys import KeyGate


class KeysInTime(ABC):
    """Sends keys, lets time pass, and returns the keys that count."""

    now_s = 0.0

    @abstractmethod
    def look(self):
        """Let the reading thread look once."""

    @abstractmethod
    def send(self, text):
        """Send keys now."""

    @abstractmethod
    def taken(self):
        """Return each received key, its time, and the last time when it was surely not there."""

    @abstractmethod
    def quiet(self):
        """Return the latest time without input, ``None`` if unknown."""

    def until(self, at_s, every_s=0.005):
        """Let time pass with a look at this interval; 0 for none."""
        while every_s and self.now_s + every_s <= at_s:
            self.now_s += every_s
            self.look()
        self.now_s = at_s

    def key(self, text, at_s, every_s=0.005):
        self.until(at_s, every_s)
        self.send(text)

    def counted(self):
        """Let the late loop read; return the keys that count, and whether a burst is reported."""
        gate = KeyGate()
        found = [one.key for press in self.taken() for one in gate.press(*press)]
        quiet_s = self.quiet()
        assert quiet_s is not None
        found += [one.key for one in gate.due(quiet_s)]
        return found, gate.burst_ended(quiet_s)
