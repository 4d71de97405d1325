"""Entry point of the shell and of `python -m sagline.cli`; it handles signals before any import."""

from __future__ import annotations

import os
import sys

from sagline.cli.ending import SIGNALS, exit_code_of


def app_entry() -> None:
    """Run the command and end the process."""
    for descriptor in range(3):  # if a standard stream is closed, the next opened file would get its number
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDONLY if descriptor == 1 else os.O_RDWR)
            if descriptor == 1:  # it is read-only: every write raises an error, so that no output is lost silently
                sys.stdout = os.fdopen(1, "w", encoding="utf-8", closefd=False)
    debug = "--debug" in sys.argv
    code = exit_code_of(lambda: _command(debug), debug=debug, last=True)
    if code - 128 in SIGNALS:  # Python's finalization can abort in an extension whose import was interrupted
        os._exit(code)
    sys.exit(code)


def _command(debug: bool) -> object:
    import logging
    import threading
    import warnings

    from sagline.cli.ending import report_thread
    from sagline.cli.main import app

    if not debug:  # warnings of libraries are for developers
        warnings.simplefilter("ignore")
        logging.getLogger().addHandler(logging.NullHandler())
        threading.excepthook = report_thread
    return app(prog_name="sagline", standalone_mode=False)


if __name__ == "__main__":
    app_entry()
