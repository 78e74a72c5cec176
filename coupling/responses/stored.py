"""Where the response of a ring is stored: in the run whose own ring it is, else in a file of its own, never in what was
only read."""

from pathlib import Path

from coupling.datasets import write_dataset, write_response
from coupling.files.provenance import origin, with_history
from coupling.refused import Refused


def chosen_file(source, model, out=None, overwrite=False):
    """The file of its own that a response goes into, checked before it is computed; None: it belongs into the run.

    Parameters
    ----------
    source : coupling.responses.source.Source
    model : str
        Name of the lining model.
    out : path, optional
        Left out: the run where pressures and ring are its own, else `<file>-<model>.nc` beside the file. Tunnels
        without the gate have `-tunnel-<number>` before the ending.
    overwrite : bool
        Replace a file that is there.

    Raises
    ------
    Refused
        The file is there, or its folder is not; or it is the one that the pressures come from.
    """
    if out is None and source.is_own:
        return None
    path = source.file.with_name(f"{source.file.stem}-{model}.nc") if out is None else Path(out)
    if source.tunnel is not None:
        path = path.with_name(f"{path.stem}-tunnel-{source.tunnel}{path.suffix}")
    if path.exists() and path.samefile(source.file):
        raise Refused(f"output '{path}': must not be the file of the pressures; choose another --out")
    if path.is_dir() or not path.absolute().parent.is_dir():
        raise Refused(f"output '{path}': must be a file in an existing folder; choose another --out")
    if path.exists() and not overwrite:
        raise Refused(f"output '{path}': is there already; choose another --out, or ask for --overwrite")
    return path


def store_response(response, source, model, path):
    """Store a response in the file from :func:`chosen_file`, or in the run for None; returns the file."""
    if path is None:
        write_response(source.file, response, model, source.tunnel)
        return source.file
    told = with_history("", f"response of {model} to the pressures of {source.file.name}")
    about = {"Conventions": "CF-1.11", **origin(), **response.attrs, "history": told}
    path.unlink(missing_ok=True)
    write_dataset(path, response.assign_attrs(about))
    return path
