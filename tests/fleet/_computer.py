"""``robolink`` on a computer of another name.

python -m tests.fleet._computer NAME ARGUMENT...
"""

import platform
import sys

if __name__ == "__main__":
    name = sys.argv.pop(1)
    platform.node = lambda: name

    from robolink_cli.entry import main

    main()
