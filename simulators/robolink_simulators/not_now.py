"""What a simulated machine cannot do in its present state, however correct the request."""

from robolink.errors import ConfigError


class NotNowError(ConfigError):
    """The request exists and is correct, but this machine, or its state, prevents it.

    Whoever asks again when that has changed, or asks another machine, may be served.
    """
