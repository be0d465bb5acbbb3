"""Commands about what is on record: journal, undo, recover, report."""
