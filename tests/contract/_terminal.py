"""A pseudo terminal on which a real command runs, with the inputs of a person."""

import os
import re
import select
import subprocess
import sys
import termios
import time

LONGEST_S = 20.0


class Terminal:
    """The far end of a pseudo terminal on which a command runs.

    Args:
        words: The command line.
        controlling: Whether it is the command's controlling terminal, so that closing it hangs the
            command up.
    """

    def __init__(self, *words, controlling=False):
        self.descriptor, near = os.openpty()
        self.before = termios.tcgetattr(near)
        paths = os.pathsep.join(path for path in sys.path if path)
        environment = {**os.environ, "PYTHONPATH": paths, "COLUMNS": "200", "TERM": "dumb"}
        program = "tests.contract._own_window" if controlling else "robolink_cli"
        self.command = subprocess.Popen(
            [sys.executable, "-m", program, *words],
            stdin=near,
            stdout=near,
            stderr=near,
            env=environment,
            start_new_session=True,
        )
        os.close(near)
        self.shown = ""

    def wait_for(self, pattern):
        """Read until ``pattern`` is shown, and drop everything up to it."""
        end_s = time.monotonic() + LONGEST_S
        while not (found := re.search(pattern, self.shown)):
            ready, _, _ = select.select([self.descriptor], [], [], 0.1)
            assert ready or time.monotonic() < end_s, f"{pattern!r} is not in {self.shown!r}"
            if ready:
                self.shown += self._read()
        self.shown = self.shown[found.end() :]
        return found

    def press(self, keys):
        os.write(self.descriptor, keys)

    def end(self):
        """Read to the end and return the exit code."""
        while True:
            try:
                self.shown += self._read()
            except OSError:  # the near end is closed
                break
        return self.command.wait(LONGEST_S)

    def close_window(self):
        """Close the window while the command runs, and return its exit code."""
        os.close(self.descriptor)
        self.descriptor = -1
        return self.command.wait(LONGEST_S)

    def close(self):
        if self.command.poll() is None:
            self.command.kill()
            self.command.wait()
        if self.descriptor >= 0:
            os.close(self.descriptor)

    def _read(self):
        return os.read(self.descriptor, 4096).decode("utf-8", "replace")
