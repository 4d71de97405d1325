"""Which vibrations a motion excites: those that a shaper should leave at rest."""

from __future__ import annotations

from sagline.core.arguments import brief
from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.dynamics.excitation import most_excited
from sagline.dynamics.vibration import Vibration
from sagline.motion.path import Path
from sagline.statics.stiffness import Modes


def to_shape(modes: Modes | Vibration, path: Path) -> Array:
    """The frequencies that a path excites most: one, or two where the second is excited a third as much or more.

    A mode is excited by its share of the platform's inertia on the way, at its own frequency, and it is seen by how
    much it moves the platform: the larger |phi . M d| |phi| |A(w)|/w, phi its shape, d the direction of the way, A the
    Fourier transform of the acceleration along it. This measure is plausible, not proved: it finds what to shape, not
    how much is left.

    Args:
        modes: Of the robot at a single state, best the one where the path ends: `modes(plan.state[-1])`, without the
            mass of the cables, or `vibration(plan.state[-1])`, with it.
        path: A path from rest to rest; of several moves, the one that excites a mode most counts.

    Returns:
        Frequencies [Hz], shape (1,) or (2,), the most excited first.

    Raises:
        InvalidValueError: If the modes are of several states, no mode has a frequency, or the path is in motion at an
            end or does not move.

    Source:
        docs/howto/without-vibration.md.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("article-suspended")
        >>> path = sl.quintic_path([(0, 0, 1.5), (3, 0, 1.5)], durations=2.0)
        >>> plan = sl.inverse(robot, path, tension=sl.MinimumNorm())
        >>> print(sl.to_shape(sl.modes(plan.state[-1]), path).round(2), "Hz")
        [2.75 1.84] Hz
    """
    given: object = modes
    if not isinstance(given, Modes | Vibration):
        step = "Make them: modes(plan.state[-1]), or vibration(plan.state[-1])."
        raise InvalidValueError("modes", brief(given), "a Modes or a Vibration", step)
    state = modes.state
    if state.pose.shape:
        value = f"of {len(state.pose)} states"
        raise InvalidValueError("modes", value, "of a single state", "Take those of the last: modes(plan.state[-1]).")
    return most_excited(state, modes.frequency, modes.shape, path)
