"""Journal entries of two changes of a tool on this controller and one on another."""

from robolink.journal import Journal, open_journal
from robolink.model import EntryKind, NewEntry, Signature

HERE = "epson+tcp://192.168.0.1:5000"
THERE = "epson+tcp://192.168.0.2:5000"
ANN = Signature(operator="Ann", role="engineer", os_user="cell", nozzle="N-1", lot="L-7")
OLD, NEW, CLEARED = [12.0, -3.5, -20.0, 0.0, 0.0, 0.0], [12.25, -3.5, -20, 0, 0, 0], None
POSES = [{"x_mm": 1.5, "y_mm": 2.0, "z_mm": -3.0, "u_deg": 90.0, "hand": "right"}]
FIRST, SECOND = "aaaa1111" * 4, "aaaa2222" * 4


def entry(kind: EntryKind, change: str, tool: int, **details: object) -> NewEntry:
    """Return an entry of one operation."""
    return NewEntry(kind, change=change, operation="o" + change, tool=tool, details=details)


def record_changes() -> Journal:
    """Record two changes of tool 1 on this controller and one of tool 2 on another."""
    journal = open_journal()
    here, there = journal.log(HERE, signature=ANN), journal.log(THERE)
    here.append(
        NewEntry(
            EntryKind.CALIBRATION,
            change=FIRST,
            tool=1,
            tolerance="change up to 2 mm",
            verdict="measured",
            details={"before": OLD, "proposed": NEW, "poses": POSES, "rms_mm": 0.0125},
        ),
        entry(EntryKind.DONE, FIRST, 1, before=OLD, requested=NEW, value=NEW),
    )
    there.append(entry(EntryKind.DONE, "bbbb" * 8, 2, before=None, requested=OLD, value=OLD))
    here.append(entry(EntryKind.DONE, SECOND, 1, before=NEW, requested=CLEARED, value=CLEARED))
    return journal
