"""A mailbox program in Structured Text, executed on the simulated axis group. SIMULATED."""
