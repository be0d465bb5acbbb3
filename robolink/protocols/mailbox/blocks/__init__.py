"""The blocks of the mailbox, word by word, and what guards them."""
