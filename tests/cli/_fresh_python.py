"""Command lines in a Python that has imported nothing but the command line's frame."""

import os
import subprocess
import sys
from collections.abc import Collection, Mapping, Sequence

PROGRAM = """
import os, sys
from robolink_cli.main import main
for words, variables in {lines!r}:
    sys.stdout.flush()
    if not os.fork():
        sys.argv[1:] = words
        os.environ.update(variables)
        try:
            main()
        except SystemExit as ended:
            print("ended:", ended.code or 0, sorted({heavy!r} & set(sys.modules)))
        sys.stdout.flush()
        os._exit(0)
    os.wait()
"""


def shown_and_loaded(
    lines: Sequence[tuple[Sequence[str], Mapping[str, str]]],
    heavy: Collection[str],
    **environment: str,
) -> list[list[str]]:
    """Return what each command line prints, and which of the heavy packages it has loaded.

    Each runs in a fork: what it loads is its own, and Python starts once.

    Args:
        lines: The words of each, and its own variables.
        heavy: Names of packages.
        environment: Variables of all.

    Returns:
        The lines of each; the last is ``ended: CODE [PACKAGES]``.
    """
    # The parent's import path reaches the child whichever way the project is installed.
    paths = os.pathsep.join(path for path in sys.path if path)
    given = [([*words], {**variables}) for words, variables in lines]
    done = subprocess.run(
        [sys.executable, "-S", "-c", PROGRAM.format(lines=given, heavy={*heavy})],
        env={**os.environ, "PYTHONPATH": paths, **environment},
        capture_output=True,
        text=True,
        timeout=30,
        check=True,
    )
    assert done.stderr == ""
    found: list[list[str]] = [[]]
    for line in done.stdout.splitlines():
        found[-1].append(line)
        if line.startswith("ended: "):
            found.append([])
    return found[:-1]
