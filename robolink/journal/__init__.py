"""The journal: what was done to each tool, by whom, and what is unfinished.

Append-only: an SQLite file by default, PostgreSQL by URL (docs/decisions/0011,
docs/reference/rules.md 6).
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports, old_names

if TYPE_CHECKING:
    from robolink.journal._connections import GlancingLog as GlancingLog
    from robolink.journal._connections import NamesOnRecord as NamesOnRecord
    from robolink.journal._connections import close_files as close_files
    from robolink.journal._connections import forget_memory as forget_memory
    from robolink.journal._connections import journals_added_to as journals_added_to
    from robolink.journal._connections import journals_in_use as journals_in_use
    from robolink.journal._connections import memory_journal as memory_journal
    from robolink.journal._connections import names_on_record as names_on_record
    from robolink.journal._connections import nothing_is_open as nothing_is_open
    from robolink.journal._connections import open_journal as open_journal
    from robolink.journal._connections import open_log as open_log
    from robolink.journal._copies import JournalCopy as JournalCopy
    from robolink.journal._copies import copy_journals as copy_journals
    from robolink.journal._homes import CellHome as CellHome
    from robolink.journal._homes import computer_key as computer_key
    from robolink.journal._homes import not_at_home as not_at_home
    from robolink.journal._homes import require_home as require_home
    from robolink.journal._homes import this_computer as this_computer
    from robolink.journal._identity import Meetings as Meetings
    from robolink.journal._journal import Journal as Journal
    from robolink.journal._lease_view import LEASE_S as LEASE_S
    from robolink.journal._lease_view import LeaseHolder as LeaseHolder
    from robolink.journal._lease_view import LeaseView as LeaseView
    from robolink.journal._lease_view import describe_holder as describe_holder
    from robolink.journal._lease_view import signature_here as signature_here
    from robolink.journal._lease_view import this_process as this_process
    from robolink.journal._move import JournalMove as JournalMove
    from robolink.journal._move import move_journal as move_journal
    from robolink.journal._move import plan_journal_move as plan_journal_move
    from robolink.journal._outbox import ChainCopy as ChainCopy
    from robolink.journal._outbox import JournalOutbox as JournalOutbox
    from robolink.journal._outbox import Witness as Witness
    from robolink.journal._outcome_log import JournalOutcomeLog as JournalOutcomeLog
    from robolink.journal._places import default_location as default_location
    from robolink.journal._places import may_exist as may_exist
    from robolink.journal._places import name_journals as name_journals
    from robolink.journal._places import named_by_environment as named_by_environment
    from robolink.journal._places import plant_place as plant_place
    from robolink.journal._places import shown_location as shown_location
    from robolink.journal._plant import ChainConflictError as ChainConflictError
    from robolink.journal._read_only_log import ReadOnlyLog as ReadOnlyLog
    from robolink.journal.store.entry_rows import ChainVerification as ChainVerification
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "_connections": (
                "GlancingLog NamesOnRecord close_files forget_memory journals_added_to "
                "journals_in_use memory_journal names_on_record nothing_is_open open_journal "
                "open_log"
            ),
            "_homes": "CellHome computer_key not_at_home require_home this_computer",
            "_copies": "JournalCopy copy_journals",
            "_identity": "Meetings",
            "_journal": "Journal",
            "_lease_view": (
                "LEASE_S LeaseHolder LeaseView describe_holder signature_here this_process"
            ),
            "_move": "JournalMove move_journal plan_journal_move",
            "_outbox": "ChainCopy JournalOutbox Witness",
            "_outcome_log": "JournalOutcomeLog",
            "_places": (
                "default_location may_exist name_journals named_by_environment plant_place "
                "shown_location"
            ),
            "_plant": "ChainConflictError",
            "_read_only_log": "ReadOnlyLog",
            "store.entry_rows": "ChainVerification",
        },
        old_names(__name__),
    )
