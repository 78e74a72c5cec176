"""numba's options of a kernel, compared and hashed in no time.

numba asks some ten thousand times a kernel whether two sets of options are equal, and looks each of the options up, and
its default: a fifth of the time to compile.
"""

from numba.core.targetconfig import TargetConfig

_equal, _hash = TargetConfig.__eq__, TargetConfig.__hash__
_hashes = {}


def equal(options, others):
    """As numba says; at once where the same are set, to the same."""
    if options is others or (type(options) is type(others) and options._values == others._values):
        return True
    return _equal(options, others)


def hash_of(options):
    """As numba says: that of the names of all options, which are those of their class."""
    kind = type(options)
    if kind not in _hashes:
        _hashes[kind] = _hash(options)
    return _hashes[kind]


def compare_quickly():
    """Have numba compare options so."""
    TargetConfig.__eq__, TargetConfig.__hash__ = equal, hash_of
