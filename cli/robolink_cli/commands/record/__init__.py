"""Commands about the record: journal, undo, recover, report."""
