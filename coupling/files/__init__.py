"""The files of a run as files: folder and lock, changes as a whole, checkpoints, where a result comes from."""
