"""A value that reads back wrong is read again before it counts."""

import pytest

from robolink.controllers import SimpleController, SimpleMachine
from robolink.errors import ReadBackError
from robolink.model import EntryKind, ToolOffset

BEFORE, WANTED = ToolOffset(4.5, -0.75, -9.25), ToolOffset(4.971, -0.516, -10.008)
DAMAGED = ToolOffset(4.971, -0.516, -1.0008)


class Misread(SimpleMachine):
    """Reports the given answers after a write, then the stored value."""

    def __init__(self, *answers: ToolOffset) -> None:
        super().__init__()
        self.answers = list(answers)
        self.written = 0
        super().store(2, BEFORE)

    def store(self, tool: int, offset: ToolOffset | None) -> None:
        self.written += 1
        super().store(tool, offset)

    def read(self, tool: int) -> ToolOffset | None:
        return self.answers.pop(0) if self.written and self.answers else super().read(tool)


@pytest.mark.parametrize(
    "answers", [(DAMAGED,), (DAMAGED, BEFORE)], ids=["damaged once", "damaged in two ways"]
)
def test_a_damaged_answer_to_the_read_back_is_neither_believed_nor_recorded(answers):
    machine = Misread(*answers)
    with SimpleController(machine) as controller:
        assert controller.tools.write(2, WANTED, expected=BEFORE).read_back == WANTED
        kinds = [entry.kind for entry in controller.outcomes.recorded()]
    assert machine.written == 1
    assert EntryKind.CONFLICT not in kinds


def test_a_value_that_reads_back_wrong_twice_alike_counts():
    machine = Misread(DAMAGED, DAMAGED)
    with (
        SimpleController(machine) as controller,
        pytest.raises(ReadBackError, match=r"Z -1\.001"),
    ):
        controller.tools.write(2, WANTED, expected=BEFORE)
    assert machine.written == 1
