"""Reference frequencies of robots by OpenSees; `python -m tests.dynamics.vibration.opensees` renews data/opensees.json.

It needs the package openseespy, and on Debian the packages libblas3, liblapack3 and libgfortran5. The tests read the
file only. Statics and tangent stiffness are those of OpenSees. Each cable is a chain of its catenary elements, and the
platform is a framework of stiff corotational trusses. The mass of the catenary elements depends on the order of their
nodes, so their density is 0. The masses of the cables are at the nodes instead. The error of the squared frequencies is
a series in even powers of the length of the elements, and two of its terms are eliminated by extrapolation.
"""

from __future__ import annotations

import json
from importlib import import_module
from importlib.metadata import version
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

import sagline as sl
from sagline.core.arrays import Array

FILE: Final = Path(__file__).parents[2] / "data" / "opensees.json"
STATES: Final = (
    ("article-suspended", (0.0, 0.0, 1.5)),
    ("article-suspended", (3.0, 2.0, 1.5)),
    ("cogiro", (0.0, 0.0, 2.0)),
    ("caroca", (1.0, 0.5, 1.5)),
)
COUNT: Final = 8  # number of frequencies
PARTS: Final = (12, 24, 48)  # elements of each cable
STIFF: Final = 1e11  # axial stiffness of the trusses [N]


class Model:
    """A robot at an equilibrium in OpenSees."""

    def __init__(self, ops: Any, state: sl.Equilibrium, parts: int) -> None:
        """Place nodes, elements, masses and loads."""
        self.ops, self.robot = ops, state.one_robot
        self.masses: dict[int, float] = {}
        ops.wipe()
        ops.model("basic", "-ndm", 3, "-ndf", 3)
        ops.timeSeries("Linear", 1)
        ops.pattern("Plain", 1, 1)
        self.elements = 0
        self.platform = self._place_platform(state)
        ends = state.pose.transform(self.robot.platform_anchors)
        along = (ends - self.robot.frame_anchors)[:, :2]
        along = along / np.linalg.norm(along, axis=1)[:, None]
        for i, points in enumerate(state.cables.points(parts + 1)):
            places = self.robot.frame_anchors[i] + np.column_stack((points[:, :1] * along[i], points[:, 1]))
            self._place_cable(i, places, float(state.cables.unstrained_length[i]) / parts)
        for tag, mass in self.masses.items():
            ops.mass(tag, mass, mass, mass)

    def _node(self, place: Array, mass: float = 0.0) -> int:
        tag = len(self.masses) + 1
        self.ops.node(tag, *map(float, place))
        self.masses[tag] = mass
        return tag

    def _place_platform(self, state: sl.Equilibrium) -> list[int]:
        """Nodes with the mass and the inertia of the platform, then its anchors, all joined by stiff trusses."""
        ops, robot = self.ops, self.robot
        moments, axes = np.linalg.eigh(robot.inertia)
        away = np.sqrt(np.maximum(1.5 / robot.mass * (moments.sum() - 2.0 * moments), 0.0))
        center, turned = state.pose.transform(robot.center_of_mass), state.pose.matrix @ axes
        heavy = [
            self._node(center + side * turned[:, k] * away[k], robot.mass / 6) for k in range(3) for side in (-1, 1)
        ]
        for tag in heavy:
            ops.load(tag, 0.0, 0.0, -robot.mass / 6 * robot.gravity)
        places = state.pose.transform(robot.platform_anchors)
        kept, self.anchors = np.unique(places.round(9), axis=0, return_inverse=True)
        tags = heavy + [self._node(place) for place in kept]
        ops.uniaxialMaterial("Elastic", 1, STIFF)
        for i, one in enumerate(tags):
            for other in tags[i + 1 :]:
                if np.linalg.norm(np.subtract(ops.nodeCoord(one), ops.nodeCoord(other))) > 1e-6:
                    self.elements += 1
                    ops.element("corotTruss", self.elements, one, other, 1.0, 1)
        return tags

    def _place_cable(self, i: int, places: Array, length: float) -> None:
        """Catenary elements of one cable, each with this unstrained length [m]."""
        ops, cables = self.ops, self.robot.cables
        density, weight = float(cables.linear_density[i]), float(cables.linear_density[i]) * self.robot.gravity
        last = self._node(places[0])
        ops.fix(last, 1, 1, 1)
        for k, place in enumerate(places[1:], start=2):
            new = self._node(place) if k < len(places) else self.platform[6 + int(self.anchors[i])]
            self.elements += 1
            stretch = (weight, float(cables.axial_stiffness[i]), 1.0, length, 0.0, 0.0)
            ops.element("CatenaryCable", self.elements, last, new, *stretch, 0.0, 1e-12, 50, 0)
            ops.eleLoad("-ele", self.elements, "-type", "-beamUniform", 0.0, 0.0, -weight)
            for tag in (last, new):
                self.masses[tag] += 0.5 * density * length
            last = new

    def solve(self) -> tuple[float, Array]:
        """Largest displacement of the platform to the equilibrium of OpenSees [m], and squared frequencies [1/s^2]."""
        ops = self.ops
        ops.constraints("Plain")
        ops.numberer("RCM")
        ops.system("UmfPack")
        ops.test("NormDispIncr", 1e-11, 100, 0)
        ops.integrator("LoadControl", 1.0)
        ops.algorithm("Newton")
        ops.analysis("Static")
        assert ops.analyze(1) == 0
        return max(float(np.linalg.norm(ops.nodeDisp(tag))) for tag in self.platform), np.array(ops.eigen(COUNT))


def renew() -> None:
    """Compute all states, and write the file."""
    ops: Any = import_module("openseespy.opensees")
    found = []
    for name, position in STATES:
        state = sl.inverse(sl.load_robot(name), sl.Pose(position, np.eye(3))).state
        moved, squares = zip(*(Model(ops, state, parts).solve() for parts in PARTS), strict=True)
        once = [(4.0 * fine - coarse) / 3.0 for coarse, fine in pairwise(squares)]
        square = (16.0 * once[1] - once[0]) / 15.0
        found.append(
            {
                "robot": name,
                "position_m": position,
                "unstrained_length_m": state.cables.unstrained_length.tolist(),
                "frequency_hz": (np.sqrt(square) / (2.0 * np.pi)).tolist(),
                "moved_m": max(moved),
            }
        )
    program = {
        "program": f"OpenSees {ops.version()}",
        "package": f"openseespy {version('openseespy')}",
        "elements_per_cable": PARTS,
    }
    FILE.write_text(json.dumps({**program, "states": found}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    renew()
