"""What the page asks of the dynamics, with what it assumes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from sagline.dynamics.beginning import beginning
from sagline.dynamics.chains import wave_frequency
from sagline.dynamics.damping import Damping
from sagline.dynamics.events import Break
from sagline.dynamics.simulate import run_of
from sagline.dynamics.simulation import Simulation
from sagline.dynamics.vibrating import vibration
from sagline.dynamics.vibration import Vibration
from sagline.robot.equilibrium import Equilibrium

DAMPING: Final = Damping(modal_damping=0.01)
LOSSES: Final = Damping(loss_time=1e-3)
PARTS: Final = (0.03, 0.1, 0.3, 0.7, 1.5, 2.8, 4.2)  # s: ends of the parts; the first is soon there, and soon played
LASTS: Final = PARTS[-1]
NODES = 10  # of a cable with mass: four times as fast as twice as many


def vibrating(state: Equilibrium, up_to: float) -> Vibration:
    """All modes below a frequency [Hz]."""
    return vibration(state, up_to=up_to, damping=DAMPING)


def cut(state: Equilibrium, cable: int, cable_mass: str) -> Iterator[Simulation]:
    """What follows when a cable breaks, the others keeping their lengths, in parts that grow as they are simulated.

    Args:
        state: The rest.
        cable: Which breaks.
        cable_mass: "none" or "lumped".

    Yields:
        The motion so far, from the moment before the break on; what has been told is told again the same.
    """
    given = beginning(state, None, None, LASTS)
    elements = NODES if cable_mass == "lumped" else 0
    losses = LOSSES
    if elements:  # waves in stiff cables are not to take smaller steps for their losses than for themselves
        losses = Damping(loss_time=min(LOSSES.loss_time, 2.0 / wave_frequency(given, elements)))
    run = run_of(given, elements, events=(Break(cable=cable, time=0.0),), damping=losses)
    for part in PARTS:
        yield run.until(part)
