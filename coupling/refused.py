"""What a user is told before anything starts: rule, name, value, remedy."""

from structure.inputs import InputError


class Refused(InputError):
    """What must not start: a run, a command, an option."""


class SceneError(InputError):
    """A scene that can not be run, one line a mistake."""


class RunFileError(InputError):
    """A run file that cannot be used: which one, why, and what to do."""
