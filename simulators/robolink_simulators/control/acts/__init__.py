"""What can be done to a simulated cell past the wire, each act declared with what it takes."""
