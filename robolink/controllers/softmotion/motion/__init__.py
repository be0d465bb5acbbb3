"""Moving the axis group behind a mailbox."""
