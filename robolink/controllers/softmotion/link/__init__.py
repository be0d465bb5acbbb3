"""One session on a PLC mailbox: snapshots read, commands sent, rest seen."""
