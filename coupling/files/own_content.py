"""An HDF5 file is data of its own: what would make the library read other files is refused before anything is read."""

import h5py


class ForeignContent(ValueError):
    """A file that shows the content of other files as its own."""


def require_own_content(group):
    """Refuse external links, external storage and virtual datasets; a damaged file raises what the library raises.

    group : h5py.File or h5py.Group, open; nothing of it has been read yet.

    Raises ForeignContent; OSError, KeyError, RuntimeError, ValueError: from the library.
    """
    for name in group:
        link = group.get(name, getlink=True)
        if isinstance(link, h5py.ExternalLink):
            raise ForeignContent(f"'{group.name}/{name}' is a link into the file '{link.filename}'")
        if isinstance(link, h5py.SoftLink):
            raise ForeignContent(f"'{group.name}/{name}' is a link to '{link.path}'")  # nothing here writes one
        entry = group[name]
        if isinstance(entry, h5py.Group):
            require_own_content(entry)
        elif isinstance(entry, h5py.Dataset) and (entry.external or entry.is_virtual):
            raise ForeignContent(f"'{entry.name}' has its values in other files")
