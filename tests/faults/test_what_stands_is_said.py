"""The messages of a disturbed command about the controller are true.

By default a sample of each run is disturbed. ``make soak`` uses every exchange and every durable
transaction; ``pytest -s`` shows how many, and how they ended.
"""

import re
from collections import Counter

import pytest

from tests.faults._what_stands import (
    COMMANDS,
    JOURNAL,
    WIRE,
    Command,
    Disturbed,
    check,
    whole_run,
)

_DECIDES = re.compile(r'\$Execute,"(Tool \d|TLSet \d, XY)|write_command (SELECT|WRITE_T)')
_SAMPLE = 5
"""The number of disturbed exchanges in a long run."""


def disturbed_and_checked(
    name: str, command: Command, runs: list[Disturbed], folder, *, mended: bool = False
) -> None:
    ends = Counter[str]()
    for disturbed in runs:
        try:
            ends[check(command, disturbed, folder)] += 1
        except AssertionError as error:
            error.add_note(f"{name}: {disturbed}")
            raise
    print(f"\n{name}: {len(runs)} runs, {dict(ends)}")  # noqa: T201 - for pytest -s
    if mended:
        assert set(ends) == {"done"}
    else:
        assert set(ends) > {"done"} or "done" not in ends, "nothing was disturbed"


@pytest.mark.parametrize("name", [name for name in COMMANDS if "tool set" in name])
def test_a_tool_set_says_what_stands_whatever_goes_wrong(tmp_path, name):
    command = COMMANDS[name]
    requests, commits = whole_run(command, tmp_path)
    runs = [Disturbed(WIRE[number % len(WIRE)], number) for number in range(len(requests))]
    runs += [Disturbed(how, number) for how in JOURNAL for number in range(commits)]
    disturbed_and_checked(name, command, runs, tmp_path)


@pytest.mark.parametrize("name", [name for name in COMMANDS if "recalibrate" in name])
def test_a_recalibration_says_what_stands_wherever_it_is_disturbed(tmp_path, name):
    command = COMMANDS[name]
    requests, commits = whole_run(command, tmp_path)
    # The last write of a tool, the turns about the new tip after it, and the roll-back.
    decisive = [n for n, request in enumerate(requests) if _DECIDES.match(request)]
    spread = range(decisive[-2], len(requests), (len(requests) - decisive[-2]) // 4)
    at = sorted({decisive[0], *(n + 1 for n in decisive[-3:]), *spread})[:_SAMPLE]
    runs = [Disturbed(WIRE[turn % len(WIRE)], number) for turn, number in enumerate(at)]
    # The two kinds store the same transactions, and take them in turn.
    last = commits - 1 - name.startswith("PLC") * (commits // 4)
    runs += [Disturbed(JOURNAL[n % 2], n) for n in range(last, 0, -commits // 2)]
    disturbed_and_checked(name, command, runs, tmp_path)


@pytest.mark.soak
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("how", [*WIRE, *JOURNAL])
@pytest.mark.parametrize("name", COMMANDS)
def test_what_stands_is_said_at_every_exchange_and_commit(tmp_path, name, how):
    command = COMMANDS[name]
    requests, commits = whole_run(command, tmp_path)
    count = len(requests) if how in WIRE else commits
    runs = [Disturbed(how, number) for number in range(count)]
    # A snapshot of a PLC has a checksum: an altered one is read again, and nothing is lost.
    mended = name.startswith("PLC") and str(how).endswith("GARBLE_REPLY")
    disturbed_and_checked(name, command, runs, tmp_path, mended=mended)
