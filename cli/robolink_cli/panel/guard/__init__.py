"""What a request of a browser has to be like before the panel looks at it."""
