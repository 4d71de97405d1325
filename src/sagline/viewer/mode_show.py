"""Modes that move: worked out when the platform rests, then drawn picture by picture."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable

import numpy as np

from sagline.dynamics.response_curves import ResponseCurves, response_curves
from sagline.dynamics.vibration import Vibration
from sagline.dynamics.vibration_status import VibrationStatus
from sagline.robot.equilibrium import Equilibrium
from sagline.viewer.aside import Aside
from sagline.viewer.drawn import Drawn
from sagline.viewer.modes_panel import ModesPanel
from sagline.viewer.reading import Reading
from sagline.viewer.stage import Stage
from sagline.viewer.swing import PERIOD, Swing, mode_of
from sagline.viewer.view import View

Vibrate = Callable[[Equilibrium, float], Vibration]

RESTED = 0.25  # s without a change: what is dragged is not worked out on its way


class ModeShow:
    """Follows what is shown; all of it belongs to the thread that serves."""

    def __init__(
        self,
        panel: ModesPanel,
        stage: Stage,
        aside: Aside,
        vibrate: Vibrate,
        ready: Callable[[Reading], bool],
    ) -> None:
        """Begin with nothing.

        Args:
            panel: Where the modes are listed and chosen.
            stage: Where they move.
            aside: What works them out.
            vibrate: Gives the vibration of a state up to a frequency [Hz].
            ready: Whether a reading can be had without waiting.
        """
        self._panel, self._stage, self._aside, self._vibrate, self._ready = panel, stage, aside, vibrate, ready
        self._key: Hashable = None
        self._state: Equilibrium | None = None
        self._due: float | None = None
        self._vibration: Vibration | None = None
        self._answers: dict[str, ResponseCurves] = {}  # of the vibration, by force
        self.swing: Swing | None = None

    @property
    def moving(self) -> bool:
        """Whether a mode moves."""
        return self.swing is not None

    @property
    def waiting(self) -> bool:
        """Whether something is to come without anybody's doing."""
        return self._due is not None or self._aside.busy

    def follow(self, view: View) -> None:
        """Something is shown; what hangs at rest can vibrate."""
        state, key = self._at_rest(view)
        key = (key, self._panel.up_to)
        if state is None or key != self._key:
            self._still()
            self._key, self._state, self._vibration = key, state, None
            self._due = None if state is None else time.monotonic() + RESTED
            self._panel.forget()
        elif self._vibration is not None:
            self._choose(self._vibration)

    def tick(self) -> None:
        """Draw the next picture, if something moves; see whether something is due."""
        now = time.monotonic()
        if self._due is not None and now >= self._due and self._state is not None:
            self._due = None
            state, up_to = self._state, self._panel.up_to
            self._aside.ask(lambda: self._vibrate(state, up_to), self._found, self._panel.refuse)
        if self._aside.waited:
            self._panel.wait(self._aside.waited)
        if self.swing is not None:
            phase = 2.0 * np.pi * now / PERIOD
            self._stage.swing(self.swing.state.pose, self.swing.pose(phase), self.swing.courses(phase))

    def _at_rest(self, view: View) -> tuple[Equilibrium | None, Hashable]:
        """The state whose modes are asked for, if there is one, and what tells it from others."""
        snapshot, settings = view.snapshot, view.settings
        if isinstance(snapshot, Drawn) or snapshot.plan is None or not snapshot.feasible:
            return None, None
        if view.playing or not self._ready(Reading.MODES):
            return None, None
        place = snapshot.pose.position.tobytes() + snapshot.pose.quaternion.tobytes()
        return snapshot.plan.state, (
            place,
            settings.mass,
            settings.density,
            settings.stiffness,
            settings.model,
            settings.tension,
            id(view.played),
        )

    def _found(self, vibration: Vibration) -> None:
        if vibration.state is self._state:
            self._vibration, self._answers = vibration, {}
            self._choose(vibration)

    def _answer(self, vibration: Vibration) -> ResponseCurves | None:
        """The response to the force that is chosen, if it is known; else it is worked out."""
        force = self._panel.force
        some = vibration.status is VibrationStatus.SOLVED and vibration.frequency.size > 0
        if some and force not in self._answers and not self._aside.busy:

            def answered(curves: ResponseCurves) -> None:
                if vibration is self._vibration:
                    self._answers[force] = curves
                    self._choose(vibration)

            self._aside.ask(lambda: response_curves(vibration, force), answered, self._panel.refuse)
        return self._answers.get(force)

    def _choose(self, vibration: Vibration) -> None:
        mode = mode_of(vibration, self._panel.chosen)
        if mode is None:
            self._still()
        elif self.swing is None or self.swing.mode != mode or self.swing.state is not vibration.state:
            self.swing = Swing.of(vibration, mode)
        self._panel.show(vibration, self.swing, self._answer(vibration))

    def _still(self) -> None:
        if self.swing is not None:
            self._stage.swing(self.swing.state.pose, self.swing.state.pose, self.swing.rest)
            self.swing = None
