"""A folder that a command writes into, and of which it replaces only what an earlier such command left."""

from coupling.refused import Refused


def claim(folder, files, own, title):
    """Make the folder; refuse one in which a file would be replaced that no earlier such command wrote.

    folder, files : paths;  own : name of the dataset in it by whose title, which begins so, such a folder is known.
    """
    from coupling.datasets import stored_title
    from coupling.files.folder import made

    made(folder)
    there = [file.name for file in files if file.exists()]
    if there and not stored_title(folder / own).startswith(title):
        raise Refused(
            f"output folder '{folder}': holds {there[0]}, which is not of an earlier run of this command; "
            "choose another --out"
        )
