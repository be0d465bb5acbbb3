"""What is kept about what was done: entries, markers, findings, and what stands now."""
