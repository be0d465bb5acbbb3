"""Program files to statements: lines, directives, and what is wrong with them."""
