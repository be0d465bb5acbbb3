"""The words of the mailbox on a field bus: blocks in and out, places, units, faults, watchdog."""
