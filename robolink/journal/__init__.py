"""The journal: what was done to each tool, by whom, and what is not settled yet.

Append-only: an SQLite file by default, PostgreSQL by URL (docs/decisions/0011,
docs/reference/rules.md 6).
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports, old_names

if TYPE_CHECKING:
    from robolink.journal._journal import Journal as Journal
    from robolink.journal._looking import LookingLog as LookingLog
    from robolink.journal._opening import NamesOnRecord as NamesOnRecord
    from robolink.journal._opening import close_files as close_files
    from robolink.journal._opening import forget_memory as forget_memory
    from robolink.journal._opening import memory_journal as memory_journal
    from robolink.journal._opening import names_on_record as names_on_record
    from robolink.journal._opening import nothing_is_open as nothing_is_open
    from robolink.journal._opening import open_journal as open_journal
    from robolink.journal._opening import open_log as open_log
    from robolink.journal._outcome_log import JournalOutcomeLog as JournalOutcomeLog
    from robolink.journal._places import default_location as default_location
    from robolink.journal._places import may_exist as may_exist
    from robolink.journal._processes import LeaseHolder as LeaseHolder
    from robolink.journal._processes import signature_here as signature_here
    from robolink.journal._processes import this_process as this_process
    from robolink.journal._records import ChainVerification as ChainVerification
    from robolink.journal._sightings import LEASE_S as LEASE_S
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "_journal": "Journal",
            "_outcome_log": "JournalOutcomeLog",
            "_looking": "LookingLog",
            "_opening": "NamesOnRecord close_files forget_memory memory_journal names_on_record "
            "nothing_is_open open_journal open_log",
            "_places": "default_location may_exist",
            "_processes": "LeaseHolder signature_here this_process",
            "_records": "ChainVerification",
            "_sightings": "LEASE_S",
        },
        old_names(__name__),
    )
