"""``make windows``: run the judges named here under wine, or say what the machine lacks."""

import sys
from pathlib import Path

import pytest

from tests.windows._windows_python import missing


def main() -> int:
    """Return the exit code of the judges; 1 if the machine lacks something that they need."""
    if lacks := missing():
        print("Windows was not tried: this machine lacks", *lacks, sep="\n  ")  # noqa: T201
        return 1
    here = str(Path(__file__).parent)
    settings = ["-o", "python_files=judge_*.py", "-o", "timeout=1800"]
    return pytest.main([*settings, "-v", "-rP", here, *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
