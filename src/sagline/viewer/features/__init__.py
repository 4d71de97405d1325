"""Features of the viewer, one file each; a new one is added to `FEATURES`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from sagline.viewer.feature import Feature
from sagline.viewer.features.calibration import CalibrationFeature
from sagline.viewer.features.cut import CutFeature
from sagline.viewer.features.export import ExportFeature
from sagline.viewer.features.history import HistoryFeature
from sagline.viewer.features.keyboard import KeyboardFeature
from sagline.viewer.features.labels import LabelsFeature
from sagline.viewer.features.missing import MissingFeature
from sagline.viewer.features.modes import ModesFeature
from sagline.viewer.features.proof import ProofFeature
from sagline.viewer.features.push import PushFeature
from sagline.viewer.features.region import RegionFeature
from sagline.viewer.features.state import StateFeature
from sagline.viewer.features.tensions import TensionsFeature
from sagline.viewer.features.timeline import TimelineFeature
from sagline.viewer.page import Page

# the order is that of the controls on the page and of updates; `StateFeature` and `HistoryFeature` are last, because
# they need all controls
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
    LabelsFeature,
    StateFeature,
    HistoryFeature,
)
