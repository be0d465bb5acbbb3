"""``robolink`` on a computer of another name; --killed-at as ``_killed_agent.py`` has it.

python -m tests.fleet._computer NAME [--killed-at N] ARGUMENT...
"""

import platform
import sys

if __name__ == "__main__":
    name = sys.argv.pop(1)
    platform.node = lambda: name

    if sys.argv[1] == "--killed-at":
        from tests.fleet._killed_agent import Commits

        Commits(int(sys.argv[2])).install()
        del sys.argv[1:3]

    from robolink_cli.entry import main

    main()
