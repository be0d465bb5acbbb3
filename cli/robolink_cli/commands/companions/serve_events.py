"""What ``expert serve`` tells while it answers: a sentence for a person, JSON for a script."""

import json

from robolink.errors import RobolinkError
from robolink_cli.console.output import hand_over, show
from robolink_cli.console.render import json_is_on, note


class ServeEvents:
    """Tells each event at once: a line of JSON for a script, a sentence for a person.

    It is made in the thread of the command, which alone knows whether JSON was asked for.
    """

    def __init__(self) -> None:
        self._json = json_is_on()

    def tell(self, event: str, sentence: str, **payload: object) -> None:
        """Tell an event; ``sentence`` may be empty where a person was told already."""
        if self._json:
            hand_over(json.dumps({"schema": "robolink/serve-event/1", "event": event, **payload}))
        elif sentence:
            show(sentence)

    def refused(self, sentence: str, code: str, error: RobolinkError, **payload: object) -> None:
        """Tell a refusal: a person reads what to do, a script gets the code as well."""
        note(sentence)
        self.tell("refused", "", code=code, what=error.what, remedy=error.remedy, **payload)
