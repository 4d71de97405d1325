"""All modes of a robot whose cables have mass below a frequency."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from sagline.core.arguments import optional
from sagline.core.arrays import Array, locked, number
from sagline.dynamics.cable_dynamics import one_state
from sagline.dynamics.component_modes import cable_shapes
from sagline.dynamics.damping import Damping
from sagline.dynamics.reduced import massless, setting_of
from sagline.dynamics.robot_modes import cable_shares, loss, modes_of
from sagline.dynamics.vibration import Vibration
from sagline.dynamics.vibration_status import VibrationStatus
from sagline.robot.equilibrium import Equilibrium

POINTS: Final = 41  # of a cable's shape


def vibration(state: Equilibrium, *, up_to: float, damping: Damping | None = None) -> Vibration:
    """All modes below a frequency of a robot whose cables have mass.

    A cable is a string: besides the platform on its cables, each of them rings, about its catenary, in its plane and
    out of it. None is missing: the number of modes is compared with an exact count that needs no mode.

    Args:
        state: An equilibrium, a single one, from `inverse` or `forward`.
        up_to: Frequency below which modes are wanted [Hz], > 0.
        damping: What takes energy out of the vibration, for `loss`; None: nothing.

    Returns:
        Vibration. Its status tells of an unstable equilibrium, and of cables that hang folded or slack: these have no
        linear vibration, and the modes are those of all else.

    Raises:
        InvalidValueError: If the state is no single Equilibrium, of exact or elastic cables; if up_to is not positive,
            or more than 2,000 modes lie below it.
        SaglineError: If modes and count disagree.

    Examples:
        >>> import numpy as np
        >>> import sagline as sl
        >>> pose = sl.Pose((1.0, 0.5, 1.5), np.eye(3))
        >>> state = sl.inverse(sl.load_robot("cogiro"), pose).state
        >>> found = sl.vibration(state, up_to=5.0)
        >>> print(found.frequency[:3].round(3), "Hz with cable mass")
        [3.018 3.031 3.159] Hz with cable mass
        >>> print(found.massless_frequency[0].round(3), "Hz massless")
        4.382 Hz massless

    Source:
        docs/model.md, section 11.
    """
    one_state(state)
    limit = number(up_to, "up_to", "Hz", above=0.0)
    given = optional(damping, Damping, "damping") or Damping()
    setting = setting_of(state)
    slack = tuple(int(i) for i in np.flatnonzero(~setting.strings.taut[0]))
    known: dict[str, Any] = {
        "state": state,
        "up_to": limit,
        "damping": given,
        "massless_frequency": locked(np.full(len(setting.freedom), np.nan)),
        "slack_cables": slack,
    }
    if np.isnan(setting.stiffness).any():
        return _nothing(known | {"slack_cables": ()}, VibrationStatus.NO_LENGTHS, np.empty((6, 0)))
    frequency, leaving = massless(setting, 0)
    known["massless_frequency"] = locked(frequency)
    if leaving.shape[1]:
        return _nothing(known, VibrationStatus.UNSTABLE, leaving)
    found = modes_of(setting, 0, limit)
    shares = cable_shares(setting, 0, found)
    return Vibration(
        **known,
        status=VibrationStatus.FOLDED if slack else VibrationStatus.SOLVED,
        frequency=locked(found.frequency),
        shape=locked(found.platform),
        platform_share=locked(1.0 - shares.sum(axis=0)),
        cable_share=locked(shares),
        cable_shape=locked(cable_shapes(found.components, found.ends, found.amplitudes, POINTS)),
        loss=locked(loss(state.one_robot.cables.linear_density, found, shares, given)),
        count=found.number,
        negative_directions=locked(leaving),
    )


def _nothing(known: dict[str, Any], status: VibrationStatus, leaving: Array) -> Vibration:
    """The answer without modes."""
    cables = known["state"].cables.shape[-1]
    return Vibration(
        **known,
        status=status,
        frequency=locked(np.empty(0)),
        shape=locked(np.empty((6, 0))),
        platform_share=locked(np.empty(0)),
        cable_share=locked(np.empty((cables, 0))),
        cable_shape=locked(np.empty((0, cables, POINTS, 3))),
        loss=locked(np.empty(0)),
        count=0,
        negative_directions=locked(leaving),
    )
