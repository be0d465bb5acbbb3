"""What a prompt shows of a controller: which one, and its state as it was read last."""

from contextlib import closing

import pytest

import robolink
from robolink.journal import open_journal
from robolink.model import EntryKind, NewEntry
from robolink.testing import MemoryController


@pytest.mark.parametrize(
    ("url", "kind"),
    [
        ("epson+sim://shown", "Epson"),
        ("softmotion+sim://shown", "SoftMotion"),
    ],
)
def test_a_controller_says_which_it_is_and_in_what_state(url, kind):
    with robolink.connect(url) as controller:
        identity, sent = controller.identity, controller.exchanges
        assert repr(controller.tools) == f"<{kind}ToolTable of {identity}>"
        assert repr(controller.groups[0]) == f"<{kind}Group of {identity}>"
        assert repr(controller) == f"<{kind}Controller {identity}: state not read>"
        assert controller.exchanges == sent
        state = controller.status().state.value
        assert repr(controller) == f"<{kind}Controller {identity}: {state} when read last>"
        controller.stop()
        assert repr(controller) == f"<{kind}Controller {identity}: held by a stop>"
        controller.release_stop()
        assert repr(controller).endswith("when read last>")
    assert repr(controller) == f"<{kind}Controller {identity}: closed>"


def test_one_of_another_package_says_so_too():
    with MemoryController() as controller:
        assert repr(controller).startswith("<MemoryController memory")
    assert repr(controller).endswith(": closed>")


def test_a_journal_says_where_it_is_and_its_log_of_whom(tmp_path):
    url = "epson+tcp://192.0.2.1:5000"
    with closing(open_journal(str(tmp_path / "journal.db"))) as journal:
        assert repr(journal) == f"<Journal {journal.location}>"
        log = journal.log(url)
        assert repr(log) == f"<JournalOutcomeLog of {url} in {journal.location}>"
        log.append(NewEntry(EntryKind.RAW, verdict="seen"))
    with closing(open_journal(str(tmp_path / "journal.db"), read_only=True)) as journal:
        assert repr(journal).endswith(", read only>")
