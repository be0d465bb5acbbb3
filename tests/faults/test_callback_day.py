"""A day of production: eight simulated hours, a needle change an hour, with faults."""

from robolink_simulators.testkit.program_calls import CallFault

from robolink.model import EntryKind
from tests.faults._callback_cell import MAIN, MEASURED, CallbackCell

HOURS = 8
CYCLES = 50
DAY = (
    MAIN.replace("Function main\n", "Function Recalibrate\n", 1)
    + f"""
Function main
  Integer hour, cycle
  RobolinkRestore
  Tool 1
  For hour = 1 To {HOURS}
    For cycle = 1 To {CYCLES}
      Go P1
      Print "produce"
      Go P2
      Wait 72
    Next cycle
    Print "needle"
    Recalibrate
  Next hour
  Print "evening"
Fend
"""
)


class Shift:
    """Watches production, changes needles, and causes each fault in its hour."""

    def __init__(self, cell):
        self.cell = cell
        self.hour = 0
        self.good = cell.tool.rounded(3)
        self.cycles = 0
        self.kept = []
        self.first_question = 0
        cell.runner.on_print = self.heard
        cell.calls.fault = self.bend

    def heard(self, text):
        word = text.strip()
        if word == "produce":
            self.produce()
        elif word == "needle":
            self.hour += 1
            self.first_question = len(self.cell.calls.questions)
            self.cell.change_needle()
            if self.hour == 2:
                self.cell.teach(13, MEASURED[2:3], off_mm=1.0)  # not touched
            if self.hour == 6:
                x, y, z = self.cell.simulator.world.pin_mm
                self.cell.teach(11, MEASURED)
                self.cell.simulator.world.pin_mm = (x + 0.15, y, z)
                self.cell.teach(21, (75, -75))  # the pin is bumped before the turn test

    def produce(self):
        """No part is made with an untested value."""
        self.cycles += 1
        cell, now = self.cell, self.cell.tool.rounded(3)
        assert cell.simulator.machine.tools.selected == 1
        if now != self.good:
            proof = cell.entries(EntryKind.VERIFY)[0]
            assert list(proof.details["requested"]) == list(now.components())
            assert cell.error_mm < 0.02
            self.good = now
            self.kept.append(self.hour)

    def bend(self, number, _question):
        at = number - self.first_question
        bends = {
            (3, 7): CallFault(drop_answer=True),  # the value never arrives
            (4, 9): CallFault(cut_before=True),  # the cable fails in the middle of the turn test
            (5, 11): CallFault(drop_answer=True),  # KEEP is lost
            (7, 12): CallFault(cut_after=True),  # the value is kept, and the answer to that is lost
        }
        if (self.hour, at) == (8, 3):
            self.cell.restart_server()  # the PC is updated while the program measures
            return CallFault(cut_before=True)
        return bends.get((self.hour, at))


def test_a_day_of_production(tmp_path):
    cell = CallbackCell(tmp_path, main=DAY)
    try:
        points = cell.simulator.machine.points
        cell.teach(1, (0, 30))
        shift = Shift(cell)
        assert points.get(1) != points.get(2)
        cell.run(most_s=40_000)
        assert "evening" in "".join(list(cell.runner.console)[-3:])
        shift.produce()  # the tool selected at the end
        assert cell.simulator.now_ns > HOURS * 3600 * 10**9
        assert shift.cycles == HOURS * CYCLES + 1
        # Hour 1 goes well; in hour 7 the program had KEEP before the link failed.
        assert shift.kept == [1, 7]
        assert len(cell.entries(EntryKind.DONE)) == 2
        assert len(cell.entries(EntryKind.ROLLED_BACK)) == 3  # 4, 5 and 6
        codes = {entry.details["code"] for entry in cell.entries(EntryKind.REFUSED)}
        assert codes == {"touches_not_witnessed", "point_moved"}
        assert cell.open_markers() == []
        assert cell.journal.verify().problems == ()
    finally:
        cell.close()
