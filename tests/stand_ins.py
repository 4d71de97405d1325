"""Replacements of machines and experiments that would run in real time: they end at once."""

from types import SimpleNamespace
from typing import Any

import pytest

import sagline as sl
from sagline.cli.session import OperatorSession


def instead_of_machines(monkeypatch: pytest.MonkeyPatch) -> None:
    """A twin ends instead of serving, a controller drives a machine in this process, and experiments end at once."""

    def served(server: Any, watch: Any) -> None:
        raise SystemExit(0)

    def begun(session: OperatorSession) -> None:
        if session._shadow:  # runs until Ctrl-C
            raise SystemExit(0)
        begin(session)

    begin = OperatorSession._begin
    monkeypatch.setattr(OperatorSession, "_begin", begun)

    monkeypatch.setattr("sagline.twin.server.Server.run", served)
    monkeypatch.setattr("sagline.cli.control._link", lambda robot, *_, **__: sl.twin.Machine(robot).link())
    for name in ("article.experiment.in_process", "cli.article._apart_over_s7", "cli.article._tell"):
        monkeypatch.setattr(f"sagline.{name}", lambda *_, **__: SimpleNamespace())
    monkeypatch.setattr("sagline.article.experiment_page.experiment_chapter", lambda *_: SimpleNamespace(findings=()))
    monkeypatch.setattr("sagline.article.experiment_page.write_experiment", lambda result, folder, how: folder)
