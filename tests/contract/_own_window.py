"""Run with ``python -m``: starts ``robolink`` in its own terminal; closing that hangs it up."""

import fcntl
import termios

from robolink_cli.entry import main

fcntl.ioctl(0, termios.TIOCSCTTY, 0)
main()
