"""The tool slots of a mailbox: read, written, preserved, settled."""
