"""Why a scenario has no emulated numbers."""


class NotEmulatedError(ValueError):
    """A scenario cannot be emulated; ``str()`` says why, with the figure."""
