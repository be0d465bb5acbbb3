"""What simulated controllers of all kinds share, for hosts, panels and tests."""
