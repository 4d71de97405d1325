"""Entry point of `sagline` and `python -m sagline.cli`. It handles signals before other modules are imported."""

from __future__ import annotations

import os
import sys

from sagline.cli.ending import SIGNALS, exit_code_of


def app_entry() -> None:
    """Run the command and end the process."""
    for descriptor in range(3):  # otherwise the next opened file would get the descriptor of a closed standard stream
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDONLY if descriptor == 1 else os.O_RDWR)
            if descriptor == 1:  # the replacement is read-only: writing raises an error
                sys.stdout = os.fdopen(1, "w", encoding="utf-8", closefd=False)
    debug = "--debug" in sys.argv
    code = exit_code_of(lambda: _command(debug), debug=debug, last=True)
    if code - 128 in SIGNALS:  # at its end, Python can abort in an extension module whose import was interrupted
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
