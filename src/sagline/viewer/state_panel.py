"""The panel of the state: a field for the pose, and buttons that take away what is shown as code or as a link.

All of it is one piece of HTML that never changes, so that nobody who types is disturbed; browser/pose.js and
browser/copies.js do the rest.
"""

from __future__ import annotations

from typing import Final

import viser

from sagline.robot.pose import Pose
from sagline.viewer.readout import block
from sagline.viewer.wording import number

FIRST: Final = -0.9  # among the controls: above all but what is played
EXAMPLE: Final = "1, 0, 1.5 or 1, 0, 1.5, 10, 0, 0"
STEP: Final = f"Give meters, and degrees about z, y and x: {EXAMPLE}."
HINT: Final = "Position in meters, and if need be angles about z, y and x in degrees. Enter goes there."
_CONTENT: Final = block(
    '<div class="state"><label for="sagline-pose">x, y, z [m], α, β, γ [°]</label>'
    f'<input id="sagline-pose" type="text" autocomplete="off" spellcheck="false" title="{HINT}"'
    ' aria-describedby="sagline-pose-told">'
    '<div id="sagline-pose-told" class="bad" role="alert"></div>'
    '<div class="copies"><button type="button" data-copy="code" title="Lines of Python for what is shown">'
    "Copy as code</button>"
    '<button type="button" data-copy="link" title="A link that brings another page to the same">Copy link</button>'
    '<button type="button" data-keys class="small" aria-label="Keys" title="What keys do">?</button></div></div>'
)


def add_state_panel(gui: viser.GuiApi) -> None:
    """Build it."""
    gui.add_html(_CONTENT, order=FIRST)


def pose_text(pose: Pose) -> str:
    """A pose as the field takes it, to a tenth of a millimeter and a hundredth of a degree; no angles where level."""
    place = [_short(value, ".4f") for value in pose.position]
    angles = [_short(value, ".2f") for value in pose.rotation.as_euler("ZYX", degrees=True)]
    return ", ".join(place if angles == ["0"] * 3 else place + angles)


def _short(value: float, form: str) -> str:
    return number(value, form).rstrip("0").rstrip(".")
