"""What simulated controllers of all kinds are alike in, for hosts, panels and tests."""
