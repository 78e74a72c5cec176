"""Verification problems with closed-form or independently published answers, each a small scene with its error norm.

A problem is a :class:`Problem`: a name, the source of its answer, and a function that runs it once with given settings
and returns the measured error. `gush accuracy` runs ladders of settings over them; the tests run the fast setting.
"""

from verification.problems.problem import Problem, Result, problems, register

__all__ = ["Problem", "Result", "problems", "register"]
