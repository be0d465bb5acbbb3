"""How the tables of a recipe go together: what no table can tell alone."""
