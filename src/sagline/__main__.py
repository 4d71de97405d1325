"""Entry point of `python -m sagline`."""

from sagline.cli.__main__ import app_entry

if __name__ == "__main__":
    app_entry()
