"""Commands at one controller: state, stop, tools, inputs, variables, jog, backup."""
