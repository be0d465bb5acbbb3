"""SPEL+ programs: from files to operations that tasks carry out."""
