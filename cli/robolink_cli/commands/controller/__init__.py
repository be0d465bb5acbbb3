"""Commands at one controller: look, calm, tools, inputs, variables, jog, backup."""
