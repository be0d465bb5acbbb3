"""Unchanged files of the suite, under a Windows Python with the wheel."""

import re
import subprocess
import tomllib
from pathlib import Path
from typing import Final

import pytest

LIST: Final = tomllib.loads((Path(__file__).parent / "named_list.toml").read_text("utf-8"))


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("group", LIST["group"], ids=lambda group: group["name"])
def test_the_named_files_pass(windows, suite, group):
    options = ["-p", "no:cacheprovider", "-q", "-rs", "-o", "timeout=1800"]
    options += [f"--deselect={test}" for test in group.get("without", {})]
    done = subprocess.run(
        windows.command("-m", "pytest", *options, *group["files"]),
        cwd=suite,
        env=windows.environment({}),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        errors="replace",
        timeout=3500,
        check=False,
    )
    assert done.returncode == 0, f"{done.stdout[-6000:]}\n{done.stderr[-2000:]}"
    counted = re.search(r"(\d+) passed", done.stdout)
    assert counted, done.stdout[-2000:]
    assert int(counted[1]) >= group["at_least"]
    lines = done.stdout.strip().splitlines()
    why = [line for line in lines if line.startswith("SKIPPED")]
    print(f"{group['name']}: {lines[-1]}", *why, sep="\n  ")  # noqa: T201 - the figures
