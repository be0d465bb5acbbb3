"""The own eye: pictures of an ordinary camera, and what is found in them."""
