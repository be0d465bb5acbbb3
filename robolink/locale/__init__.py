"""The languages of robolink, and their catalogues of sentences."""
