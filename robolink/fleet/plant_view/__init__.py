"""What a plant sees of its cells: their state, metrics, messages, a report."""
