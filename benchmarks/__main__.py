"""Print the table of ratios."""

from benchmarks.exchange import measure_exchange
from benchmarks.journal import measure_journal
from benchmarks.kinematics import measure_kinematics
from benchmarks.mailbox import measure_mailbox
from benchmarks.nozzle_change import measure_nozzle_change
from benchmarks.plc_program import measure_plc_program
from benchmarks.solvers import measure_solvers
from benchmarks.spel_programs import measure_spel_programs
from benchmarks.start_up import measure_start_up
from benchmarks.stopping import measure_stopping
from benchmarks.table import print_table
from benchmarks.transaction import measure_transaction


def main() -> None:
    """Run every measurement."""
    print_table(
        [
            *measure_exchange(),
            *measure_transaction(),
            *measure_mailbox(),
            *measure_journal(),
            *measure_nozzle_change(),
            *measure_start_up(),
            *measure_stopping(),
            *measure_solvers(),
            *measure_kinematics(),
            *measure_spel_programs(),
            *measure_plc_program(),
        ]
    )


if __name__ == "__main__":
    main()
