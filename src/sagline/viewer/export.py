"""What one takes away to other programs: the scene as GLB. Bytes in memory, no browser."""

from __future__ import annotations

from typing import Any

import numpy as np
import trimesh
from trimesh.transformations import compose_matrix, quaternion_matrix

from sagline.robot.batch import pulleys_of
from sagline.viewer import lines, solids
from sagline.viewer.drawn import Drawn
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.stage import DRUM, INFEASIBLE, PLATFORM, STEEL
from sagline.viewer.tension_scale import TensionScale

_CABLE_RADIUS = 0.0012  # of the robot's size: real cables would not be seen
_DEAD_RADIUS = 0.0006  # the same of what runs guided behind the pulleys
_Z_UP_TO_Y_UP = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


def scene_as_glb(snapshot: Snapshot | Drawn, scale: TensionScale, sag_scale: float = 1.0) -> bytes:
    """Frame, pulleys, winches, platform and cables, in meters, y up as glTF wants it."""
    robot = snapshot.robot
    scene = trimesh.Scene()
    place = np.eye(4)
    place[:3, :3], place[:3, 3] = snapshot.pose.matrix, snapshot.pose.position
    _add(scene, "frame", solids.frame(robot), STEEL)
    still = solids.winches(robot)
    if len(still.faces):
        _add(scene, "winches", still, DRUM)
    for i, (radius, turn) in enumerate(zip(pulleys_of(robot).radius, solids.turns(robot, snapshot.pose), strict=True)):
        if radius > 0.0:
            stands = compose_matrix(scale=np.full(3, radius), translate=robot.frame_anchors[i])
            _add(scene, f"pulley {i}", solids.wheel(), DRUM, stands @ quaternion_matrix(turn))
    thin = _DEAD_RADIUS * solids.size_of(robot)
    for i, (run, known) in enumerate(zip(*lines.dead_runs(robot), strict=True)):
        if run[0, 2] != run[1, 2]:
            _add(
                scene,
                f"dead cable {i}" if known else f"dead cable {i}, its way not known",
                solids.rod(run, thin),
                STEEL,
            )
    _add(scene, "platform", solids.platform(robot), PLATFORM if snapshot.feasible else INFEASIBLE, place)
    colors = scale.colors(snapshot.tension)
    for i, course in enumerate(snapshot.courses(sag_scale)):
        _add(scene, f"cable {i}", solids.tube(course, _CABLE_RADIUS * solids.size_of(robot)), tuple(colors[i]))
    scene.apply_transform(_Z_UP_TO_Y_UP)
    glb: bytes = scene.export(file_type="glb")
    return glb


def _add(scene: Any, name: str, solid: solids.Solid, color: tuple[int, ...], place: Any = None) -> None:
    mesh = trimesh.Trimesh(solid.vertices, solid.faces, process=False)
    shade = [*(int(part) for part in color[:3]), 255]
    mesh.visual = trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.PBRMaterial(baseColorFactor=shade, metallicFactor=0.1, roughnessFactor=0.7)
    )
    scene.add_geometry(mesh, node_name=name, geom_name=name, transform=place)
