"""A script whose processes import it again, and so would begin the same work again, is told so before it starts."""

import ast
import sys
from pathlib import Path


def guard_missing():
    """The script that a new process would import as a whole, this call included; None where nothing would.

    Returns
    -------
    pathlib.Path or None
        File of the main module, when the line of it that led here stands outside of ``if __name__ == "__main__":``.
    """
    file = getattr(sys.modules.get("__main__"), "__file__", None)
    if file is None:  # an interactive session, whose statements no process imports
        return None
    frame = sys._getframe()
    while frame is not None:
        code = frame.f_code
        if code.co_name == "<module>" and frame.f_globals.get("__name__") == "__main__" and code.co_filename == file:
            return None if _guarded(Path(file), frame.f_lineno) else Path(file)
        frame = frame.f_back
    return None


def _guarded(file, line):
    try:
        tree = ast.parse(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, SyntaxError):  # compiled, or an archive
        return True
    return any(
        isinstance(node, ast.If) and node.lineno <= line <= node.end_lineno and _asks_for_main(node.test)
        for node in tree.body
    )


def _asks_for_main(test):
    words = {node.id if isinstance(node, ast.Name) else getattr(node, "value", None) for node in ast.walk(test)}
    return {"__name__", "__main__"} <= words
