"""A response held against the limits of a file, for the command line: variables, largest utilisations, a picture."""

from coupling.run_folder import FIGURES, RunRefused


def read_limits(path):
    """`structure.Limits` of a TOML file.

    Raises
    ------
    RunRefused
        Not readable.
    structure.InputError
        No TOML, or no limits: every mistake with key, rule, value and remedy.
    """
    from structure import Limits

    try:
        return Limits.from_toml(path)
    except OSError as problem:
        raise RunRefused(f"limits '{path}': cannot be read: {problem.strerror}; give a TOML file") from problem


def with_checks(response, limits):
    """The response with the variables of `structure.check`, and the largest value of every utilisation (dict).

    Raises
    ------
    RunRefused
        The response lacks what a limit needs.
    """
    from structure import check
    from structure.checks import UTILISATIONS

    try:
        checked = check(response, limits)
    except ValueError as problem:
        raise RunRefused(str(problem)) from problem
    return checked, {name: float(checked[name].max()) for name in UTILISATIONS if name in checked}


def draw_checks(checked, file, model, own_file=None, tunnel=None):
    """Draw the checks beside a run's figures, or beside the response's own file and named after it; returns the path.

    file : path, of the run;  own_file : path or None, from :func:`coupling.stored_response.chosen_file`;  tunnel : int
    or None, of those without the gate.
    """
    from coupling.check_figures import checks
    from coupling.figures import RESOLUTION

    folder = file.parent / FIGURES
    path = (folder if folder.is_dir() else file.parent) / (
        f"checks-{model}{'' if tunnel is None else f'-tunnel-{tunnel}'}.png"
    )
    if own_file is not None:
        path = own_file.with_name(f"{own_file.stem}-checks.png")
    checks(checked).savefig(path, dpi=RESOLUTION)
    return str(path)
