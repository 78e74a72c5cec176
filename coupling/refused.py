"""What a user is told before anything starts: rule, name, value, remedy."""

import difflib

from structure.inputs import InputError


def did_you_mean(name, known):
    """The remedy of a name that is not known: the nearest one that is, else all."""
    near = difflib.get_close_matches(name, known, 1)
    return f"did you mean {near[0]!r}?" if near else f"known: {', '.join(known)}"


class Refused(InputError):
    """What must not start: a run, a command, an option."""


class SceneError(InputError):
    """A scene that can not be run, one line a mistake."""


class RunFileError(InputError):
    """A run file that cannot be used: which one, why, and what to do."""
