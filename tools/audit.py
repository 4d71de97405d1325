"""`python -m tools.audit [PIP-AUDIT]`: licenses and known vulnerabilities of the packages that sagline needs.

Exit code 0: no problem; 1: a license that is not permitted, or a vulnerability; 3: no database could be reached.
`python -m tools.audit --pins` prints the versions of the installed packages, for constraints.txt.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path
from typing import Any, Final

ROOT: Final = Path(__file__).parents[1]
PINS: Final = ROOT / "constraints.txt"
FOUND, UNREACHED = 1, 3  # exit codes
PERMITTED: Final = (
    *("0bsd", "apache", "bsd", "cc0", "cmu", "hpnd", "isc", "mit", "mozilla public license 2.0", "mpl-2.0", "psf"),
    *("python software foundation", "zlib"),
)
EXCEPTIONS: Final = {  # each with its reason
    "fmpy": "its text of the license is that of BSD-2-Clause",
    "graphemeu": "its text of the license is that of MIT",
    "moocore": "LGPL, a library that pymoo loads in its own process space; sagline does not distribute it",
}
REQUIREMENT: Final = re.compile(r"([\w.-]+)(?:\[([\w,.\s-]*)\])?")
EXTRA: Final = re.compile(r"extra\s*==\s*['\"]([\w.-]+)['\"]")


def needed(extras: frozenset[str] | None = None) -> dict[str, Distribution]:
    """Installed packages that sagline needs, with the extras (None: all), by their normalized names."""
    found: dict[str, Distribution] = {}
    seen: set[tuple[str, str]] = set()
    top = distribution("sagline")
    chosen = frozenset(top.metadata.get_all("Provides-Extra") or ()) if extras is None else extras
    waiting = [("sagline", extra) for extra in ("", *sorted(chosen))]
    while waiting:
        name, extra = waiting.pop()
        if (name, extra) in seen:
            continue
        seen.add((name, extra))
        try:
            package = distribution(name)
        except PackageNotFoundError:  # for another system, or of an extra that is not installed
            continue
        found[name] = package
        for text in package.requires or ():
            match = REQUIREMENT.match(text)
            asked = EXTRA.search(text)
            if match is not None and (asked[1] if asked else "") == extra:
                other = re.sub(r"[-_.]+", "-", match[1]).lower()
                waiting += [(other, each.strip()) for each in ("", *(match[2] or "").split(","))]
    del found["sagline"]
    return dict(sorted(found.items()))


def license_of(package: Distribution) -> str:
    """License of a package, from its metadata."""
    data: Any = package.metadata
    kinds = [kind.rpartition(" :: ")[2] for kind in data.get_all("Classifier") or () if kind.startswith("License ::")]
    text = str(data.get("License-Expression") or "; ".join(kinds) or data.get("License") or "")
    return next(iter(text.splitlines()), "")[:100]


def refused_licenses(packages: dict[str, Distribution]) -> Iterator[str]:
    """One line for each package whose license is not permitted."""
    for name, package in packages.items():
        text = license_of(package)
        parts = re.split(r"\s+AND\s+|;\s*", text)
        if name not in EXCEPTIONS and not all(any(word in part.lower() for word in PERMITTED) for part in parts):
            yield f"{name} {package.version}: license {text or 'not stated'}"


def pins(packages: dict[str, Distribution]) -> str:
    """Versions of packages, as a file of constraints."""
    head = "# Versions with which sagline is tested: pip install -c constraints.txt sagline. Made by: make pins\n"
    return head + "".join(f"{name}=={package.version}\n" for name, package in packages.items())


def vulnerabilities(program: str) -> tuple[int, str]:
    """Exit code and report of pip-audit for the pinned versions."""
    words = [program, "--requirement", str(PINS), "--no-deps", "--disable-pip", "--format", "json"]
    try:
        done = subprocess.run([*words, "--progress-spinner", "off"], capture_output=True, text=True)
        packages = json.loads(done.stdout)["dependencies"]
    except (OSError, ValueError) as error:  # it is not installed, or prints a reason
        return UNREACHED, f"no database of vulnerabilities was reached: {type(error).__name__} of {program}"
    return verdict(packages)


def verdict(packages: list[dict[str, Any]]) -> tuple[int, str]:
    """Exit code and report of the packages that pip-audit lists."""
    found = [f"{each['name']} {each['version']}: {bug['id']}" for each in packages for bug in each.get("vulns", ())]
    skipped = [each["name"] for each in packages if "skip_reason" in each]
    if found:
        return FOUND, "\n".join([f"{len(found)} known vulnerabilities", *found])
    if skipped or not packages:
        some = ", ".join(skipped[:5])
        return UNREACHED, f"no database of vulnerabilities was reached for {len(skipped)} packages: {some}"
    return 0, f"no known vulnerabilities in {len(packages)} packages"


def main() -> int:
    """Print licenses that are not permitted, and vulnerabilities."""
    packages = needed()
    if "--pins" in sys.argv:
        print(pins(packages), end="")
        return 0
    refused = list(refused_licenses(packages))
    print("\n".join([f"{len(packages)} packages, {len(refused)} licenses that are not permitted", *refused]))
    for name, reason in EXCEPTIONS.items():
        if name in packages:
            print(f"exception: {name} {packages[name].version}, {license_of(packages[name])}: {reason}")
    code, report = vulnerabilities(sys.argv[1] if len(sys.argv) > 1 else "pip-audit")
    print(report)
    return FOUND if refused else code


if __name__ == "__main__":
    sys.exit(main())
