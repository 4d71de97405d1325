"""Machines and experiments that a command would wait for in real time: accepted, and done with at once."""

from types import SimpleNamespace
from typing import Any

import pytest

import sagline as sl


def instead_of_machines(monkeypatch: pytest.MonkeyPatch) -> None:
    """A twin ends as soon as it would serve, a controller drives a machine in this process, experiments are over."""

    def served(server: Any, watch: Any) -> None:
        raise SystemExit(0)

    def linked(robot: sl.Robot, asked: Any) -> Any:
        if asked.shadow:  # until Ctrl-C
            raise SystemExit(0)
        return sl.twin.Machine(robot).link()

    monkeypatch.setattr("sagline.twin.server.Server.run", served)
    monkeypatch.setattr("sagline.cli.control._link", linked)
    for name in ("in_process", "apart_over_s7", "_tell", "experiment_chapter"):
        monkeypatch.setattr(f"sagline.cli.experiment.{name}", lambda *_, **__: SimpleNamespace(findings=()))
    monkeypatch.setattr("sagline.cli.experiment.write_experiment", lambda result, folder, how: folder)
