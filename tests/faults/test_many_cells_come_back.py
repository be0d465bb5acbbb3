"""Two thousand cells behind a switch that restarts: row F77. One job delivered twice: row F79."""

from collections import Counter
from itertools import pairwise

import pytest
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

import robolink
from robolink.controllers import connect_when_reachable
from robolink.controllers.registry import FIRST_PAUSE_S, LONGEST_PAUSE_S
from robolink.errors import (
    ConfigError,
    ConnectError,
    LoginRefusedError,
    TransportBrokenError,
    TransportTimeoutError,
)
from robolink.model import EntryKind, Secret, ToolOffset
from robolink.timing import NS_PER_S
from robolink.transaction import Wanted, change_tools

CELLS = 2000
DOWN_S = 600.0
ATTEMPT_S = 3.0
"""The duration of an unanswered attempt."""


class Cell:
    """A cell behind the switch; knocks by its own clock, which begins with the cut."""

    def __init__(self) -> None:
        self.clock = ManualClock()
        self.knocked_s: list[float] = []
        self.gave_up_s: list[float] = []

    @property
    def now_s(self) -> float:
        return self.clock.now_ns() / NS_PER_S

    def knock(self) -> float:
        self.knocked_s.append(self.now_s)
        if self.now_s >= DOWN_S:
            return self.now_s
        self.clock.sleep(ATTEMPT_S)
        self.gave_up_s.append(self.now_s)
        raise ConnectError("nobody there")


@pytest.mark.fault("F77")
def test_f77_two_thousand_cells_that_come_back_do_not_knock_together():
    cells = [Cell() for _ in range(CELLS)]
    back_s = [connect_when_reachable(cell.knock, within_s=3600, clock=cell.clock) for cell in cells]
    assert max(back_s) < DOWN_S + ATTEMPT_S + LONGEST_PAUSE_S
    # Once they have drifted apart, no second has more than three times its share of the knocks.
    seconds = Counter(int(at_s) for cell in cells for at_s in cell.knocked_s if at_s > 120)
    share = sum(seconds.values()) / (DOWN_S + LONGEST_PAUSE_S - 120)
    assert max(seconds.values()) < 3 * share
    assert max(len(cell.knocked_s) for cell in cells) < 40
    for cell in cells:
        pauses = [
            later - end for later, end in zip(cell.knocked_s[1:], cell.gave_up_s, strict=True)
        ]
        assert pauses[0] >= FIRST_PAUSE_S / 2  # from the end of an attempt, not from its beginning
        assert all(later > earlier * 0.99 for earlier, later in pairwise(pauses[:5]))
        assert max(pauses) <= LONGEST_PAUSE_S


@pytest.mark.fault("F77")
def test_f77_waiting_ends_in_time_and_with_the_cause_of_the_last_attempt():
    cell = Cell()
    with pytest.raises(ConnectError, match="nobody there"):
        connect_when_reachable(cell.knock, within_s=30, clock=cell.clock)
    assert 30 <= cell.now_s <= 30 + ATTEMPT_S
    cell = Cell()
    with pytest.raises(ConnectError):
        connect_when_reachable(cell.knock, within_s=0, clock=cell.clock)
    assert len(cell.knocked_s) == 1
    for wrong in (-1.0, float("nan")):
        with pytest.raises(ConfigError):
            connect_when_reachable(cell.knock, within_s=wrong, clock=cell.clock)


@pytest.mark.fault("F77")
@pytest.mark.parametrize("error", [TransportBrokenError, TransportTimeoutError])
def test_f77_a_link_that_breaks_while_connecting_is_tried_again(error):
    left = [error("gone"), error("gone")]

    def knock() -> str:
        if left:
            raise left.pop()
        return "there"

    assert connect_when_reachable(knock, within_s=600, clock=ManualClock()) == "there"


@pytest.mark.fault("F77")
def test_f77_a_wrong_password_is_not_tried_again():
    simulator = EpsonSimulator(seed=2, password=Secret("canary-right"))
    with serve_tcp(simulator) as host:
        with pytest.raises(LoginRefusedError):
            connect_when_reachable(
                lambda: robolink.connect(host.url, password="canary-wrong"), within_s=600
            )
        logins = [text for _, way, text in simulator.log if way == ">" and "ogin" in text]
        assert len(logins) == 1
        with connect_when_reachable(
            lambda: robolink.connect(host.url, password="canary-right"), within_s=600
        ) as controller:
            assert controller.status().ready


@pytest.mark.fault("F79")
def test_f79_a_change_that_is_delivered_twice_is_made_once():
    simulator = EpsonSimulator(seed=2)
    old, new = ToolOffset(12.0, -3.5, -20.0), ToolOffset(12.25, -3.5, -20.0)
    simulator.machine.tools.set(1, old)
    written = simulator.machine.flash_writes
    with serve_tcp(simulator) as host:
        for _ in range(2):  # the very same order, from the same message
            with robolink.connect(host.url) as controller:
                change_tools(controller, [Wanted(1, new, old)])
                done = list(controller.outcomes.recorded(kinds=(EntryKind.DONE,)))
    assert simulator.machine.flash_writes == written + 1
    assert simulator.machine.tools.get(1) == new
    assert len(done) == 1
