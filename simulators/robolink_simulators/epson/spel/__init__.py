"""SPEL+, the language of EPSON controllers: command-window statements, simulated.

Parsing (``_parse``, ``grammar.lark``) knows no machine; evaluation (``_evaluate``,
``_functions``) changes none; statements (``_statements``, ``_settings``, ``_motion``) do;
the interpreter runs them one after the other in simulated time.
"""

from robolink_simulators.epson.spel.interpreter import Interpreter as Interpreter
from robolink_simulators.epson.spel.interpreter import SpelError as SpelError
from robolink_simulators.epson.spel.interpreter import StatementExecution as StatementExecution
