"""Where in a TOML text a key stands, found with the parser itself: the shortest beginning of the text that has it."""

import re
import tomllib

# an error message is not worth more; a longer search gives no line
MOST_PARSES = 300


def line_of(text, path):
    """Number of the line on which the statement with a key begins.

    Parameters
    ----------
    text : str
        Valid TOML.
    path : tuple of str and int
        Keys of tables and indices of lists, as ("soils", 0, "porosity").

    Returns
    -------
    int or None
        From 1; None where the text has no such key.
    """
    prefixes = _Prefixes(text)
    low, high = 0, len(prefixes.lines)
    if not path or not holds(prefixes.parsed(high), path):
        return None
    try:
        while high - low > 1:
            middle = (low + high) // 2
            count, data = prefixes.whole(middle)
            if count > low and holds(data, path):
                high = count
            else:
                low = middle
        before, _ = prefixes.whole(high - 1)
    except _TooLong:
        return None
    return before + 1


def holds(data, path):
    """Whether nested dictionaries and lists have an entry at `path`; a table may name entries of a list by number."""
    for part in path:
        if isinstance(data, dict):
            part = str(part)
            if part not in data:
                return False
        elif not (isinstance(data, list) and isinstance(part, int) and part < len(data)):
            return False
        data = data[part]
    return True


def path_of(message, location, data):
    """The key that a message is about: its location, and names of tables and keys that the message mentions.

    Parameters
    ----------
    message : str
        As "soil 'sand': porosity must ..", "tunnel 0: ..", "gate: width ..".
    location : tuple of str and int
        Of the table whose check failed; empty for the whole scene.
    data : dict
        The scene.
    """
    path = tuple(location)
    table = entry_at(data, path)
    if not path:
        head = re.match(r"(\w+?)s?\b(?: (?:'([^']*)'|(\d+)))?", message)
        name, called, number = head.groups() if head else ("", None, None)
        entries = data.get(f"{name}s")
        if isinstance(data.get(name), dict):
            path = (name,)
        elif isinstance(entries, list | tuple) and (called or number) is not None:
            names = [entry.get("name") if isinstance(entry, dict) else None for entry in entries]
            index = int(number) if number else names.index(called) if called in names else len(entries)
            path = (f"{name}s", index) if index < len(entries) else (f"{name}s",)
        elif entries is not None:
            path = (f"{name}s",)
        table = entry_at(data, path)
    if isinstance(table, dict):
        key = next((word for word in re.findall(r"\w+", message) if word in table), None)
        path = (*path, key) if key is not None else path
    return path


def entry_at(data, path):
    """The entry at `path` of nested dictionaries and lists; None where there is none."""
    for part in path:
        try:
            data = data[part]
        except (KeyError, IndexError, TypeError):
            return None
    return data


class _TooLong(Exception):
    pass


class _Prefixes:
    """Beginnings of a text, parsed when asked for; a statement over several lines is whole or not there."""

    def __init__(self, text):
        self.lines, self._known = text.split("\n"), {}

    def whole(self, count):
        """The longest valid beginning of at most `count` lines, and its data."""
        while (data := self.parsed(count)) is None:
            count -= 1
        return count, data

    def parsed(self, count):
        """Data of the first `count` lines, None where they are no valid TOML."""
        if count not in self._known:
            if len(self._known) >= MOST_PARSES:
                raise _TooLong
            try:
                self._known[count] = tomllib.loads("\n".join(self.lines[:count]))
            except ValueError:
                self._known[count] = None
        return self._known[count]
