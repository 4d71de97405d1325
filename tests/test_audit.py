"""Licenses, pinned versions and the result of `make audit`."""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import distribution, version
from pathlib import Path
from typing import Any

import pytest

from tools import audit

ROOT = Path(__file__).parents[1]
PINNED = dict(re.findall(r"^([\w.-]+)==(\S+)$", audit.PINS.read_text(encoding="utf-8"), re.MULTILINE))


def test_every_dependency_has_a_pinned_version_in_its_range() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = {name: texts for name, texts in project["optional-dependencies"].items() if name != "docs"}
    for text in (*project["dependencies"], *(text for texts in extras.values() for text in texts)):
        name, least = re.fullmatch(r"([\w-]+)>=([\d.]+)\S*", text).groups()  # type: ignore[union-attr]
        assert _numbers(PINNED[re.sub(r"[-_.]+", "-", name).lower()]) >= _numbers(least), text


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(map(int, re.findall(r"\d+", text)[:3]))


def test_all_packages_have_a_permitted_license() -> None:
    packages = audit.needed()
    assert packages.keys() >= {"numpy", "h5py", "viser", "pymodbus", "pymoo"}
    assert packages.keys() <= PINNED.keys()
    assert list(audit.refused_licenses(packages)) == []
    assert all(reason for reason in audit.EXCEPTIONS.values())


@pytest.mark.parametrize(
    ("text", "permitted"),
    [("MIT", True), ("BSD-3-Clause AND MIT", True), ("GPL-3.0-only", False), ("MIT AND GPL-2.0", False), ("", False)],
)
def test_a_license_that_is_not_listed_is_reported(text: str, permitted: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(audit, "license_of", lambda package: text)
    found = list(audit.refused_licenses({"numpy": distribution("numpy")}))
    assert bool(found) != permitted
    assert all(version("numpy") in line for line in found)


@pytest.mark.parametrize(
    ("packages", "code"),
    [
        ([{"name": "a", "version": "1", "vulns": []}], 0),
        ([{"name": "a", "version": "1", "vulns": [{"id": "CVE-1"}]}, {"name": "b", "skip_reason": "x"}], audit.FOUND),
        ([{"name": "a", "version": "1", "vulns": []}, {"name": "b", "skip_reason": "x"}], audit.UNREACHED),
        ([], audit.UNREACHED),
    ],
)
def test_a_package_without_a_database_entry_is_reported(packages: list[dict[str, Any]], code: int) -> None:
    assert audit.verdict(packages)[0] == code


def test_a_missing_program_is_reported_in_one_line() -> None:
    code, report = audit.vulnerabilities("no-such-program")
    assert (code, report.count("\n")) == (audit.UNREACHED, 0)
    assert "no-such-program" in report
