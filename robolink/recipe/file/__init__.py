"""What stands in a recipe file: its tables, the schema for editors, and what is wrong in it."""
