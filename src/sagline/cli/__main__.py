"""`python -m sagline.cli` is the command `sagline`."""

from sagline.cli.main import app_entry

app_entry()
