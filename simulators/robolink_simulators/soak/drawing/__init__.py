"""How a seed draws what happens to a cell: which hours, which faults, and when."""
