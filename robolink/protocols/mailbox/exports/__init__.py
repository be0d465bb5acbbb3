"""What is generated from the mailbox's schema: register map, data sheet, Structured Text."""
