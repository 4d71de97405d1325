"""What the viewer shows at a moment."""

from __future__ import annotations

from dataclasses import dataclass

from sagline.viewer.drawn import Drawn
from sagline.viewer.settings import Settings
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.tension_scale import TensionScale


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """What is shown: a snapshot, and how it is drawn."""

    snapshot: Snapshot | Drawn
    settings: Settings
    scale: TensionScale
    ghost: bool
