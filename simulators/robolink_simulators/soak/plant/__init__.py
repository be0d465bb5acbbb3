"""The machines that stand in a virtual cell, as the adversary sees and disturbs them."""
