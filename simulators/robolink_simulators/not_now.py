"""What a simulated machine cannot do as it is now, however well it was asked."""

from robolink.errors import ConfigError


class NotNowError(ConfigError):
    """What was asked for is there and was asked for rightly; this machine, or its state, bars it.

    Whoever asks again when that has changed, or asks another machine, may be served.
    """
