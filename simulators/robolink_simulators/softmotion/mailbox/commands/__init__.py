"""The commands of the mailbox program, by what they are about."""
