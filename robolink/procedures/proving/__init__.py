"""The proof of a written offset as a value, which a change keeps until it is made."""
