"""Changes of a file that happen as a whole or not at all, whatever stops the program or the machine.

HDF5 changes a file in many places; stopped in between, it leaves a file that nobody can open. Here the changed pages
are collected in memory, written to a journal beside the file with a checksum, and only then into the file. A complete
journal that is found later is written again; an incomplete one belongs to a change that never began.
Source: redo logging, Gray and Reuter (1992), ch. 9.
"""

import contextlib
import hashlib
import io
import os
import struct
from pathlib import Path

from coupling.files.replace import synchronise

PAGE = 4096
MAGIC = b"gush journal 1\n\0"
HEAD = struct.Struct("<16sQQ")  # magic, size of the changed file, number of pages
DIGEST = hashlib.sha256().digest_size


class Overlay(io.RawIOBase):
    """A file as it would be with some of its pages changed; the file itself is only read.

    path : path;  pages : dict of int to bytearray, optional, changed pages by number;  size : int, optional, size of
    the changed file [bytes].
    """

    def __init__(self, path, pages=None, size=None):
        self._file = open(path, "rb", buffering=0)
        self.pages = {} if pages is None else pages
        self._size_below = self._kept = os.fstat(self._file.fileno()).st_size
        self.size = self._size_below if size is None else size
        self._position = 0

    def close(self):
        """Close the file below."""
        self._file.close()
        super().close()

    def readable(self):
        """True."""
        return True

    def writable(self):
        """True: into the pages in memory."""
        return True

    def seekable(self):
        """True."""
        return True

    def seek(self, offset, whence=os.SEEK_SET):
        """Move, and return the new position."""
        self._position = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._position, os.SEEK_END: self.size}[whence]
        return self._position

    def truncate(self, size=None):
        """Set the size; what lies beyond is zero when the file grows again."""
        size = self._position if size is None else size
        self._kept = min(self._kept, size)
        if size < self.size:
            for number in [n for n in self.pages if n * PAGE >= size]:
                del self.pages[number]
            if size % PAGE:
                self._page(size // PAGE)[size % PAGE :] = bytes(PAGE - size % PAGE)
        self.size = size
        return size

    def readinto(self, buffer):
        """Read at the position."""
        view = memoryview(buffer).cast("B")
        count = max(0, min(len(view), self.size - self._position))
        view[:count] = self._below(self._position, count)
        for number, inside, part in self._pieces(count):
            if number in self.pages:
                view[part] = self.pages[number][inside]
        self._position += count
        return count

    def write(self, data):
        """Write at the position, into memory."""
        view = memoryview(data).cast("B")
        for number, inside, part in self._pieces(len(view)):
            self._page(number)[inside] = view[part]
        self._position += len(view)
        self.size = max(self.size, self._position)
        return len(view)

    def _pieces(self, count):
        """Pages of so many bytes from the position on: number, what of the page, and what of these bytes it is."""
        first, last = self._position, self._position + count
        for number in range(first // PAGE, -(-last // PAGE)):
            begin, end = max(first, number * PAGE), min(last, (number + 1) * PAGE)
            yield number, slice(begin - number * PAGE, end - number * PAGE), slice(begin - first, end - first)

    def _page(self, number):
        if number not in self.pages:
            self.pages[number] = bytearray(self._below(number * PAGE, PAGE))
        return self.pages[number]

    def _below(self, offset, length):
        read = os.pread(self._file.fileno(), max(0, min(length, self._kept - offset)), offset)
        return read + bytes(length - len(read))

    def all_pages(self):
        """Changed pages by number, with those that were cut off and are zero now."""
        for number in range(self._kept // PAGE, -(-min(self.size, self._size_below) // PAGE)):
            self._page(number)
        return self.pages


@contextlib.contextmanager
def changed(path):
    """Open a file for a change that happens as a whole: yields a file object; what is written to it counts at the end.

    An exception inside leaves the file as it was.

    Raises OSError: no space or no right to write: the file is as it was, or its journal is complete and `recover`
    finishes.
    """
    path = Path(path)
    recover(path)
    with Overlay(path) as overlay:
        yield overlay
        pages, size = overlay.all_pages(), overlay.size
    journal = journal_of(path)
    try:
        _write_journal(journal, pages, size)
    except OSError:
        with contextlib.suppress(OSError):
            journal.unlink()
        raise
    _apply(path, pages, size)
    journal.unlink()


def recover(path):
    """Finish a change that was stopped; returns whether there was one."""
    journal = journal_of(path)
    if not journal.exists():
        return False
    found = _read_journal(journal)
    if found is not None:
        _apply(path, *found)
    journal.unlink()
    return found is not None


def readable(path):
    """The file, or where a complete journal lies beside it a file object that shows it changed; for reading only."""
    journal = journal_of(path)
    with contextlib.suppress(FileNotFoundError):
        found = _read_journal(journal)
        if found is not None:
            return Overlay(path, *found)
    return Path(path)


def journal_of(path):
    """Path of a file's journal."""
    return Path(f"{path}.journal")


def _write_journal(journal, pages, size):
    digest = hashlib.sha256()
    with open(journal, "wb") as file:
        parts = [HEAD.pack(MAGIC, size, len(pages))]
        parts += [struct.pack("<Q", number) + page for number, page in sorted(pages.items())]
        for part in parts:
            digest.update(part)
            file.write(part)
        file.write(digest.digest())
        file.flush()
        os.fsync(file.fileno())
    synchronise(journal.parent)


def _read_journal(journal):
    """Pages and size of a complete journal, else None."""
    content = journal.read_bytes()
    body = content[:-DIGEST]
    if len(body) < HEAD.size or hashlib.sha256(body).digest() != content[-DIGEST:]:
        return None
    _, size, count = HEAD.unpack_from(body)
    pages = {}
    for k in range(count):
        at = HEAD.size + k * (8 + PAGE)
        pages[struct.unpack_from("<Q", body, at)[0]] = bytearray(body[at + 8 : at + 8 + PAGE])
    return pages, size


def _apply(path, pages, size):
    with open(path, "r+b") as file:
        for number, page in sorted(pages.items()):
            file.seek(number * PAGE)
            file.write(page)
        file.truncate(size)
        file.flush()
        os.fsync(file.fileno())
