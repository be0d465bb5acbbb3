"""SPEL+, the language of EPSON controllers: command-window statements, simulated.

Parsing (``parser``, ``grammar.lark``) knows no machine; evaluation (``expressions``) changes none;
statements (``statements``, ``execution``) do; the interpreter runs them one after the other in
simulated time.
"""

from robolink_simulators.epson.spel.interpreter import Interpreter, SpelError, StatementExecution

__all__ = [
    "Interpreter",
    "SpelError",
    "StatementExecution",
]
