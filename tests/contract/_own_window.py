"""``python -m`` this: ``robolink`` in a terminal of its own, so that closing it hangs it up."""

import fcntl
import termios

from robolink_cli.entry import main

fcntl.ioctl(0, termios.TIOCSCTTY, 0)
main()
