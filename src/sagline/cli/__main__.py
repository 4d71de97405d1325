"""Entry point of the command `sagline` and of `python -m sagline.cli`; signals are handled before other imports."""

from __future__ import annotations

import os
import sys

from sagline.cli.ending import SIGNALS, exit_code_of


def app_entry() -> None:
    """Run the command and end the process."""
    for descriptor in range(3):  # otherwise an opened file would get the descriptor of a closed standard stream
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDONLY if descriptor == 1 else os.O_RDWR)
            if descriptor == 1:  # a read-only replacement: writing raises an error, so no output is lost silently
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
