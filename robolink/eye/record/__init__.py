"""What is kept of pictures: small copies, what was found in them, and marks made by hand."""
