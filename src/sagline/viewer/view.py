"""What the viewer shows at a moment."""

from __future__ import annotations

from dataclasses import dataclass

from sagline.core.arrays import Array
from sagline.viewer.drawn import Drawn
from sagline.viewer.played import Played
from sagline.viewer.settings import Settings
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.tension_scale import TensionScale


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """What is shown, and how it is drawn.

    Attributes:
        snapshot: The robot.
        settings: What is set.
        scale: Colors of tensions.
        ghost: Whether straight cables are drawn beside the real ones.
        wrench: External wrench on a platform that is dragged, shape (6,); None for none.
        played: What is played, if that is shown; None for a pose of one's own.
        playing: Whether its time goes on.
    """

    snapshot: Snapshot | Drawn
    settings: Settings
    scale: TensionScale
    ghost: bool
    wrench: Array | None = None
    played: Played | None = None
    playing: bool = False
