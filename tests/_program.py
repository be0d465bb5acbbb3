"""Runs a program text as ``python -c`` does: ``python -m tests._program TEXT ARGUMENTS``.

For programs of tests that need robolink and do not look at what is imported: they are forked from
a process that has imported it (``tests/_warm_process.py``).
"""

import sys

if __name__ == "__main__":
    exec(sys.argv.pop(1), {"__name__": "__main__"})
