"""Modes as a list for a person: of which robot each is, with cable mass or massless, and what swings in it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.core.arrays import Array
from sagline.dynamics.at_rest import stretch_losses
from sagline.dynamics.vibration import Vibration
from sagline.statics.stiffness import modes

WITH_MASS, MASSLESS = "with cable mass", "massless"


class ListedMode(NamedTuple):
    """One mode.

    Attributes:
        number: From 1 on, among those of its kind.
        kind: "with cable mass" or "massless".
        frequency: [Hz].
        platform_share: Share of the kinetic energy that is the platform's.
        cable: The cable that has the largest share; None where no cable has any.
        cable_share: Its share.
        loss: Damping ratio.
    """

    number: int
    kind: str
    frequency: float
    platform_share: float
    cable: int | None
    cable_share: float
    loss: float

    @property
    def name(self) -> str:
        """What it is asked for by: "1", "massless 1"."""
        return f"{self.number}" if self.kind == WITH_MASS else f"{MASSLESS} {self.number}"

    @property
    def swings(self) -> str:
        """What has the largest part in it, in words."""
        if self.cable is None or self.platform_share >= self.cable_share:
            return "platform"
        return f"cable {self.cable}"


def listed_modes(vibration: Vibration) -> list[ListedMode]:
    """All modes with cable mass, then the massless ones, each ascending."""
    most = np.argmax(vibration.cable_share, axis=0) if vibration.frequency.size else ()
    swinging = [
        ListedMode(
            k + 1,
            WITH_MASS,
            float(vibration.frequency[k]),
            float(vibration.platform_share[k]),
            int(cable),
            float(vibration.cable_share[cable, k]),
            float(vibration.loss[k]),
        )
        for k, cable in enumerate(most)
    ]
    damping, platform = vibration.damping, modes(vibration.state)
    losses = damping.modal_damping + stretch_losses(vibration.state, platform, damping.loss_time)
    return swinging + [
        ListedMode(k + 1, MASSLESS, float(frequency), 1.0, None, 0.0, float(losses[k]))
        for k, frequency in enumerate(platform.frequency)
        if np.isfinite(frequency)
    ]


def successors(vibration: Vibration) -> Array:
    """For each massless mode the share of its motion that is found in each mode with cable mass, shape (n, K).

    A share is the square of the mass-weighted product of both motions of the platform; over all modes, those beyond
    `up_to` included, the shares of a massless mode sum to less than 1 by what the cables keep.
    """
    massless = modes(vibration.state).shape
    mass = np.linalg.pinv(massless @ massless.T)
    return np.asarray((massless.T @ mass @ vibration.shape) ** 2)
