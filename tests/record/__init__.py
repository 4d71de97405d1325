"""The record of behavior: what a user of sagline can see, as numbers and names in JSON files beside this page.

`make record` writes it again; `tests/record/test_record.py` compares it in the second tier, with the tolerances of
`tests.record.compare`. A change of the source that is not meant to change behavior leaves these files as they are.

- `surface.json`: names and signatures of the public surface.
- `commands.json`: exit code, `--json` output and files of the commands on the examples, files by their values.
- `formats.json`: files that the library writes from fixed inputs, by their values.
- `poses.json`: statuses, residuals, tensions and lengths of random poses of every preset, by model and method.

The messages of the command line are a snapshot of their own, see `tests/cli/test_messages.py`.
"""
