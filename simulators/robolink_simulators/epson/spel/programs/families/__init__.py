"""Statements that only programs know, by family: tasks, ports, texts. A family is one module."""
