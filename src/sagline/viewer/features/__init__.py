"""Features of the viewer, one file each; a new one is added to `FEATURES`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from sagline.viewer.feature import Feature
from sagline.viewer.features.calibration import CalibrationFeature
from sagline.viewer.features.cut import CutFeature
from sagline.viewer.features.export import ExportFeature
from sagline.viewer.features.keyboard import KeyboardFeature
from sagline.viewer.features.missing import MissingFeature
from sagline.viewer.features.modes import ModesFeature
from sagline.viewer.features.proof import ProofFeature
from sagline.viewer.features.push import PushFeature
from sagline.viewer.features.region import RegionFeature
from sagline.viewer.features.state import StateFeature
from sagline.viewer.features.tensions import TensionsFeature
from sagline.viewer.features.timeline import TimelineFeature
from sagline.viewer.page import Page

# in the order of their controls on the page, in which they also follow a view; the state is last: it needs all controls
FEATURES: Final[tuple[Callable[[Page], Feature | None], ...]] = (
    CalibrationFeature.of_page,
    ModesFeature,
    RegionFeature,
    PushFeature,
    CutFeature,
    ExportFeature,
    TimelineFeature,
    KeyboardFeature,
    TensionsFeature,
    MissingFeature,
    ProofFeature,
    StateFeature,
)
