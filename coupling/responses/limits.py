"""A response held against the limits of a file."""

from coupling.refused import Refused


def read_limits(path):
    """`structure.Limits` of a TOML file.

    Raises
    ------
    Refused
        Not readable.
    structure.InputError
        No TOML, or no limits: every mistake with key, rule, value and remedy.
    """
    from structure import Limits

    try:
        return Limits.from_toml(path)
    except OSError as problem:
        raise Refused(f"limits '{path}': cannot be read: {problem.strerror}; give a TOML file") from problem


def with_checks(response, limits):
    """The response with the variables of `structure.check`, and the largest value of every utilisation (dict).

    Raises
    ------
    Refused
        The response lacks what a limit needs.
    """
    from structure import check
    from structure.checks import UTILISATIONS

    try:
        checked = check(response, limits)
    except ValueError as problem:
        raise Refused(str(problem)) from problem
    return checked, {name: float(checked[name].max()) for name in UTILISATIONS if name in checked}
