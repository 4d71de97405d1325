"""recipe/recipe.yaml, for conda-forge, agrees with pyproject.toml."""

import re
import tomllib
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).parents[1]
FILE = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT = FILE["project"]
RECIPE: dict[str, Any] = yaml.safe_load((ROOT / "recipe" / "recipe.yaml").read_text(encoding="utf-8"))
NAMES = {"matplotlib": "matplotlib-base"}  # without a compiler for Windows
OTHER_BUILD = {"ziglang"}  # conda-forge has its own compilers


def as_conda(requirement: str) -> str:
    """Requirement in the notation of conda: `numpy>=2.0` is `numpy >=2.0`."""
    name, bound = re.fullmatch(r"([\w-]+)(>=[\d.]+)", requirement).groups()  # type: ignore[union-attr]
    return f"{NAMES.get(name, name)} {bound}"


def test_name_and_version_agree_with_the_project() -> None:
    assert RECIPE["schema_version"] == 1
    assert RECIPE["context"] == {"name": PROJECT["name"], "version": PROJECT["version"]}
    about = RECIPE["about"]
    assert (about["license"], [about["license_file"]]) == (PROJECT["license"], PROJECT["license-files"])
    assert PROJECT["description"].startswith(about["summary"])


def test_requirements_agree_with_the_project() -> None:
    run, host = RECIPE["requirements"]["run"], RECIPE["requirements"]["host"]
    assert run == ["python", *map(as_conda, PROJECT["dependencies"])]
    built = [each for each in FILE["build-system"]["requires"] if re.split(r"\W", each)[0] not in OTHER_BUILD]
    assert host == ["python", "pip", *map(as_conda, built)]


def test_excluded_systems_and_python_versions_agree_with_the_project() -> None:
    bound = PROJECT["requires-python"].removeprefix(">=")
    assert RECIPE["build"]["skip"] == ["not linux", f'match(python, "<{bound}")']
    systems = [each.rsplit(" ", 1)[1] for each in PROJECT["classifiers"] if each.startswith("Operating System")]
    assert systems == ["Linux"]
