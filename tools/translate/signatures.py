"""Types of the arguments with which sagline calls its entries, declared once.

An entry is a kernel marked with `@entry`, found by its name in any module of `sagline.kernels`. It is listed once for
each set of argument types; the key of a set names its purpose and is part of the name in C.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import pkgutil
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Final

from tools.translate.types import NONE, ArrayType, Element, Scalar, Type, plain_tuple

BOOL, INT, FLOAT = Scalar.BOOL, Scalar.INT, Scalar.FLOAT
F1, F2, F3, F4 = (ArrayType(Element.FLOAT, rank) for rank in range(1, 5))
I1, I2, I4 = (ArrayType(Element.INT, rank) for rank in (1, 2, 4))
CODES1, CODES2 = (ArrayType(Element.BYTE, rank) for rank in (1, 2))
FLAGS1, FLAGS2 = (ArrayType(Element.FLAG, rank) for rank in (1, 2))
C2, C3, C4 = (ArrayType(Element.COMPLEX, rank) for rank in (2, 3, 4))

MODEL: Final = plain_tuple(INT, FLOAT, FLOAT)  # code, k_h, k_p
TERMS: Final = plain_tuple(INT, FLOAT, FLOAT, FLOAT)  # cable model with gravity
FORWARD: Final = plain_tuple(INT, FLOAT, FLOAT, NONE)  # None: no pulleys or dead lengths
FORWARD_PULLEYS: Final = plain_tuple(INT, FLOAT, FLOAT, BOOL)
LIMITS: Final = plain_tuple(INT, FLOAT)
DISTRIBUTION: Final = plain_tuple(INT, FLOAT, INT, F1, F1)
ROBOTS: Final = plain_tuple(F2, F2, F3)
MEMORY: Final = plain_tuple(F1, I1)
ANSWERS: Final = plain_tuple(F3, CODES2, F2, F2, CODES1)
GIVEN: Final = plain_tuple(F2, F2, F3, F2, F2, F2)
FOUND: Final = plain_tuple(F2, F3, CODES2, F2, CODES1)
STATES: Final = plain_tuple(F3, F4, F4, F3, F3, F3)
SENSITIVITIES: Final = plain_tuple(F3, F4, F3, F3, F3, F3)
CHAIN: Final = plain_tuple(F2, F2, F1)
COURSE: Final = plain_tuple(F1, F2, F2, F2)
COURSES: Final = plain_tuple(COURSE, COURSE, COURSE, COURSE)
KEPT: Final = plain_tuple(F1, F2, F2, F2, F1, I1, F1)
BODY: Final = plain_tuple(F2, F1, F1, F2)
OBSERVED: Final = (GIVEN, plain_tuple(*[F1] * 8), plain_tuple(*[F2] * 4), plain_tuple(I2, F2, F3), MEMORY)
OBSERVATIONS: Final = plain_tuple(F3, F2, F2, F3, F3, F2)
STATE: Final = (TERMS, plain_tuple(*[F1] * 8))
SOLVED: Final = (TERMS, plain_tuple(*[F1] * 5), plain_tuple(F1, F1, F1, CODES1))
RUN: Final = (plain_tuple(*[INT] * 5), plain_tuple(*[FLOAT] * 4), BODY, F2, COURSES, KEPT, plain_tuple(*[F2] * 5))
INVERSE: Final = (MODEL, DISTRIBUTION, LIMITS, ROBOTS, F2, F2, F1, MEMORY)
RULE: Final = plain_tuple(F2, F2, F3, F3)  # spectral elements: nodes, weights, slopes, integrals
DYNAMIC_MODEL: Final = (INT, FLOAT, FLOAT, FLOAT)
LOADS: Final = (plain_tuple(FLOAT, FLOAT), F2, F1, F2, F1, F2, F2, F2, F2)


# argument types of each entry, by the entry's name and the key of the set
SIGNATURES: Final[dict[str, dict[str, tuple[Type, ...]]]] = {
    "batch_from_length": {"": SOLVED},
    "batch_from_tension": {"": (*SOLVED, F2)},
    "begin_period": {"": (plain_tuple(F1, F1, F1), F1, F1, F2, COURSE, F1, I1, BOOL, BOOL, FLOAT)},
    "cable_courses": {"": (F2, F1, F1, F1, INT, F2, F2, F3)},
    "cable_geometries": {"": (F3, F2, F2, F2, F3)},
    "cable_loads": {
        "": (plain_tuple(*DYNAMIC_MODEL, NONE), *LOADS),
        "pulleys": (plain_tuple(*DYNAMIC_MODEL, BOOL), *LOADS),
    },
    "closures": {"": (*STATE, F1)},
    "creep_strains": {"": (F1, F2, F1, F1, FLAGS1, F2)},
    "cut_piece": {"": (F1, F2, F2)},
    "decide_poses": {
        "": (MODEL, LIMITS, ROBOTS, F2, F2, I1, BOOL, MEMORY, ANSWERS, plain_tuple(F2, F2, F2, FLAGS2)),
    },
    "compliances_of": {"": (F2, F3, MEMORY, F3)},
    "describe_states": {
        "": (FORWARD, ROBOTS, F2, F3, MEMORY, STATES),
        "pulleys": (FORWARD_PULLEYS, ROBOTS, F2, F3, MEMORY, STATES),
    },
    "dynamic_stiffnesses": {"": (F3, F3, FLOAT, F2, F4, I4), "damped": (F3, C3, FLOAT, C2, C4, I4)},
    "exits_of_forces": {"": (F3, F1, F3, F3, F2, F3)},
    "fill_routing_compliance": {"": (TERMS, F3, F2, F2, F2, F3)},
    "fit_poses": {"": (BOOL, GIVEN, CHAIN, MEMORY, FOUND)},
    "follow_memory": {"": (F2, F2, F1, BOOL, F2, F2)},
    "forward_poses": {
        "": (FORWARD, BOOL, GIVEN, CHAIN, MEMORY, FOUND),
        "pulleys": (FORWARD_PULLEYS, BOOL, GIVEN, CHAIN, MEMORY, FOUND),
    },
    "underconstrained_poses": {
        "": (MODEL, LIMITS, ROBOTS, F2, F2, I1, FLOAT, BOOL, MEMORY, ANSWERS, F2, FLAGS2, INT, INT),
    },
    "interpolate": {"": (F2, FLOAT, RULE, F3, F3)},
    "inverse_poses": {
        "": (*INVERSE, NONE, BOOL, ANSWERS, INT, INT),
        "methods": (*INVERSE, BOOL, BOOL, ANSWERS, INT, INT),
    },
    "inverse_poses_of_slanted": {"": (*INVERSE[:4], F3, *INVERSE[4:], BOOL, ANSWERS, INT, INT)},
    "least_distances": {"": (F3, F2, I2, FLOAT, BOOL, F2, F2, F2, F2, F4)},
    "least_stiffnesses": {"": (F2, F3, MEMORY, F1)},
    "lengths_at_frame_ends": {"": (TERMS, F2, F1, F1, F1, F1, F1, F2, F2)},
    "lengths_of_turns": {"": (F2,) * 4},
    "margins_of_poses": {"": (MODEL, LIMITS, ROBOTS, F2, F2, F2, MEMORY, F1)},
    "node_counts": {"": (F2, FLOAT, I1)},
    "observe": {
        "": (FORWARD, *OBSERVED, OBSERVATIONS),
        "pulleys": (FORWARD_PULLEYS, *OBSERVED, OBSERVATIONS),
    },
    "platform_state": {"": (F1,) * 5},
    "polygon_of_pose": {
        "": (
            MODEL,
            DISTRIBUTION,
            LIMITS,
            ROBOTS,
            F1,
            F1,
            plain_tuple(F1, F1),
            MEMORY,
            plain_tuple(F1, F1, F2, F2, F2, I1),
        ),
    },
    "prove_boxes": {
        "": (
            MODEL,
            LIMITS,
            ROBOTS,
            plain_tuple(F1, F2, F3, F2, I1),
            F2,
            plain_tuple(FLOAT, FLOAT),
            MEMORY,
            plain_tuple(CODES1, CODES1),
        ),
    },
    "sensitivities_of_lengths": {
        "": (FORWARD, LIMITS, ROBOTS, F2, F3, F2, MEMORY, STATES, F3),
        "pulleys": (FORWARD_PULLEYS, LIMITS, ROBOTS, F2, F3, F2, MEMORY, STATES, F3),
    },
    "sensitivities_of_states": {
        "": (FORWARD, ROBOTS, F2, F3, MEMORY, STATES, SENSITIVITIES),
        "pulleys": (FORWARD_PULLEYS, ROBOTS, F2, F3, MEMORY, STATES, SENSITIVITIES),
    },
    "stabilities_of_poses": {
        "": (FORWARD, ROBOTS, F2, I1, MEMORY, F3, CODES1),
        "pulleys": (FORWARD_PULLEYS, ROBOTS, F2, I1, MEMORY, F3, CODES1),
    },
    "read_cells": {"": (F1, F2, F1, F1)},
    "read_encoders": {"": (plain_tuple(F2, F2), F1, F1, F1, F1, F3, F1)},
    "run_massless": {
        "": (plain_tuple(*DYNAMIC_MODEL, NONE), *RUN, INT, INT),
        "pulleys": (plain_tuple(*DYNAMIC_MODEL, BOOL), *RUN, INT, INT),
    },
    "run_chains": {
        "": (
            plain_tuple(INT, INT, INT),
            plain_tuple(FLOAT, FLOAT, FLOAT),
            plain_tuple(F2, F1, F2, F1),
            F2,
            COURSES,
            KEPT,
            plain_tuple(F2, F3, F3, F2, I1),
            F1,
            plain_tuple(F2, F2, F2, F2, F2, F4),
            INT,
            INT,
        ),
    },
    "largest_sags": {"": (*STATE, F1)},
    "shape_points": {"": (*STATE, F3)},
    "signed_margins": {
        "": (
            MODEL,
            LIMITS,
            ROBOTS,
            plain_tuple(F1, F1, F2, F3, F2, I1, F1, F3),
            plain_tuple(F1, F1),
            F2,
            plain_tuple(F1, I1, CODES1),
            plain_tuple(F2, F2, I1, CODES1),
            INT,
            INT,
        ),
    },
    "spectral_matrices": {"": (F2, FLOAT, RULE, F3, F3, F3, F3, F2)},
    "swivel_readings": {"": (FORWARD_PULLEYS, GIVEN, MEMORY, F3)},
    "starting_lengths": {"": (TERMS, F2, F2, F1, F2, F2, MEMORY, F2)},
    "stretch_matrices": {"": (F2, FLOAT, RULE, F3, F3)},
    "structure_matrices": {"": (F3, F3)},
    "turns_of_lengths": {"": (F2,) * 5},
}


@cache
def functions() -> dict[str, FunctionType]:
    """Entries of all modules of `sagline.kernels`, as Python functions, by name."""
    package = importlib.import_module("sagline.kernels")
    found: dict[str, FunctionType] = {}
    for each in pkgutil.walk_packages(package.__path__, "sagline.kernels."):
        module = importlib.import_module(each.name)
        for name in _marked(Path(module.__file__ or "").read_text(encoding="utf-8")):
            found[name] = inspect.unwrap(getattr(module, name))
    return found


def _marked(source: str) -> list[str]:
    """Names of the functions of a module that are marked as entries."""
    if "@entry" not in source:
        return []
    definitions = [node for node in ast.parse(source).body if isinstance(node, ast.FunctionDef)]
    return [each.name for each in definitions if "entry" in map(ast.unparse, each.decorator_list)]


def entries() -> Iterator[tuple[FunctionType, tuple[Type, ...], str]]:
    """All entries with their argument types and their names in C."""
    found = functions()
    for name, sets in SIGNATURES.items():
        for key, types in sets.items():
            yield found[name], types, f"sagline_{name}{f'_{key}' if key else ''}"
