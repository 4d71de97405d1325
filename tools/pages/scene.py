"""Picture of a robot in MuJoCo, drawn by its renderer."""

from __future__ import annotations

import io
from typing import Any, Final

import numpy as np
from PIL import Image

import sagline as sl

SIZE: Final = 1200, 640  # px
PLACE: Final = 1.2, 1.0, 2.5  # of the platform [m]


def drawn_robot() -> tuple[Any, Any]:
    """Model and data of a robot whose lower cables sag visibly, above a floor."""
    import mujoco

    spec = sl.mujoco.model_of(sl.load_robot("article-mixed"), PLACE)
    sky = {"builtin": mujoco.mjtBuiltin.mjBUILTIN_GRADIENT, "rgb1": (0.93, 0.95, 0.97), "rgb2": (0.7, 0.78, 0.86)}
    spec.add_texture(name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, width=64, height=64, **sky)
    floor = {"pos": (0.0, 0.0, -0.02), "contype": 0, "conaffinity": 0, "rgba": (0.84, 0.85, 0.83, 1.0)}
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=(9.0, 7.0, 1.0), **floor)
    spec.worldbody.add_light(pos=(0.0, -4.0, 12.0), dir=(0.0, 0.3, -1.0))
    spec.visual.global_.offwidth, spec.visual.global_.offheight = SIZE
    spec.visual.headlight.ambient = (0.45, 0.45, 0.45)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def camera() -> Any:
    """Camera in front of the frame."""
    import mujoco

    found = mujoco.MjvCamera()
    found.lookat, found.distance, found.azimuth, found.elevation = (0.0, 0.0, 2.6), 18.0, 100.0, -13.0
    return found


def drawn_cables() -> dict[str, Any]:
    """Description of the picture: some places of the drawn capsules [m]."""
    import mujoco

    model, data = drawn_robot()
    scene, every = mujoco.MjvScene(model, maxgeom=1000), mujoco.mjtCatBit.mjCAT_ALL
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera(), every, scene)
    capsules = [each for each in scene.geoms[: scene.ngeom] if each.type == mujoco.mjtGeom.mjGEOM_CAPSULE]
    return {"capsules": np.round([[*each.pos, each.size[0]] for each in capsules[::8]], 2).tolist()}


def draw_robot() -> dict[str, bytes]:
    """The picture."""
    import mujoco

    model, data = drawn_robot()
    renderer, content = mujoco.Renderer(model, SIZE[1], SIZE[0]), io.BytesIO()
    renderer.update_scene(data, camera())
    Image.fromarray(renderer.render()).save(content, "PNG")
    renderer.close()
    return {"mujoco.png": content.getvalue()}
