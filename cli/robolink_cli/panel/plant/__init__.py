"""What the panel knows of the plant: its plans, and the jobs that line computers order."""
