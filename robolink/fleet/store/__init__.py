"""The plant's database: plans, their outcomes, halts and permits."""
