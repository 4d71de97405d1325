"""paper/paper.md: the sections that the journal requires, existing references, and a test for each number."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import yaml

import sagline as sl
from tests.cables.reference import load_reference
from tests.tiers import extended
from tools.size import public_values

ROOT = Path(__file__).parents[2]
_, HEAD, BODY = (ROOT / "paper" / "paper.md").read_text(encoding="utf-8").split("---\n", 2)
BIBLIOGRAPHY = (ROOT / "paper" / "paper.bib").read_text(encoding="utf-8")
README = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
CITED = re.compile(r"@(\w+)")
SECTIONS = [  # in the order of the journal
    *("Summary", "Statement of need", "State of the field", "Software design", "Research impact statement"),
    *("AI usage disclosure", "References"),
]
COUNTS = re.compile(r"(\d+) tension distribution methods .*? on (\d+) published")
NUMBER = re.compile(r"\b\d+(?:\.\d+)?(?:e-?\d+)?\b")


def test_the_form_is_that_of_the_journal() -> None:
    head: dict[str, Any] = yaml.safe_load(HEAD)
    assert set(head) == {"title", "tags", "authors", "affiliations", "date", "bibliography"}
    assert (ROOT / "paper" / head["bibliography"]).is_file()
    assert {each["affiliation"] for each in head["authors"]} == {each["index"] for each in head["affiliations"]}
    assert re.findall(r"^# (.*)$", BODY, re.MULTILINE) == SECTIONS
    assert 750 <= len(BODY.split()) <= 1000  # required: 750 to 1750 words; an older limit: 1000


def test_every_reference_is_cited_and_every_citation_has_one() -> None:
    keys = re.findall(r"^@\w+\{(\w+),$", BIBLIOGRAPHY, re.MULTILINE)
    assert len(keys) == len(set(keys))
    assert set(CITED.findall(BODY)) == set(keys)
    dois = re.findall(r"doi = \{(.*?)\}", BIBLIOGRAPHY)
    pages = "".join((ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8") for name in ("bibliography", "compare"))
    assert dois
    assert all(doi in pages for doi in dois)


def errors_of_one_cable() -> float:
    """Largest relative error of the exact cable, in both directions, over all reference cables."""
    table, model = load_reference(), sl.Catenary()
    state = model.from_length(table.cable, table.span, table.rise, table.p2_length)
    force = np.hypot(state.horizontal_tension - table.p2_horizontal, state.vertical_force - table.p2_vertical)
    rows = table.span > 0.0
    span, rise = table.span[rows], table.rise[rows]
    cable = sl.Cable(table.cable.linear_density[rows], table.cable.axial_stiffness[rows])
    back = model.from_tension(cable, span, rise, table.p3_horizontal[rows] * (np.hypot(span, rise) / span))
    largest = table.largest_tension(table.p2_horizontal, table.p2_vertical, table.p2_length)
    errors = force / largest, np.abs(back.unstrained_length / table.p3_length[rows] - 1.0)
    return float(max(error.max() for error in errors))


def error_of_plan(robot: str, model: sl.CableModel) -> float:
    """Largest error of position [m] of the exact robot on the article's path, planned with the model."""
    plan = sl.inverse(sl.load_robot(robot), sl.article_path(), model, sl.MinimumNorm("horizontal"), stability=False)
    return float(np.linalg.norm(sl.confirm(plan).position_error, axis=-1).max())


def count_of(base: type) -> int:
    """Number of public classes of a kind."""
    values = public_values().values()
    return sum(isinstance(each, type) and issubclass(each, base) and each is not base for each in values)


@extended  # counts all modules of sagline
def test_every_number_is_computed() -> None:
    robots = ("article-suspended", "article-mixed")
    suspended, mixed = (f"{1e3 * error_of_plan(robot, sl.Empirical()):.2f}" for robot in robots)
    assert max(error_of_plan(robot, sl.Catenary()) for robot in robots) < 1e-12
    assert errors_of_one_cable() <= 2e-15
    assert count_of(sl.CableModel) == 5
    computed = [suspended, mixed, str(len(load_reference().group)), "90", "2e-15", "1e-12"]
    computed += [str(count_of(sl.TensionMethod)), str(len(sl.robot_names()))]
    assert COUNTS.findall(README) == [tuple(computed[-2:])]
    found = NUMBER.findall(CITED.sub("", BODY))
    assert found == computed  # in the order of the text, each number once


def test_the_readme_has_the_same_numbers() -> None:
    assert all(number in README for number in ("630 reference cables", "90 digits", "2e-15", "1e-12 m"))
