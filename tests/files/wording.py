"""Messages on whole files for comparison with a snapshot."""

from pathlib import Path

from sagline import FileError


def wording(error: FileError, folder: Path) -> str:
    """Name of the file, reason and next step, without the path of a temporary folder."""
    text = f"{error.path.name[:40]}: {error.reason}. {error.next_step}"
    return text.replace(str(folder), "FOLDER")
