"""What a page plays of a controller's log."""

from __future__ import annotations

import numpy as np

from sagline.control.states import State
from sagline.robot.pose import Pose
from sagline.share.course import Course, Verdict, chord_tension
from sagline.viewer.session import WRONG, Session


def of_session(session: Session) -> Course:
    """A controller's log: the platform where it was to be, beside a plan where it was estimated to be."""
    wanted = np.isfinite(session.planned).all(axis=1, keepdims=True)
    row = np.maximum(session.shown, 0)
    position = np.where(wanted, session.planned, session.position[row])
    quaternion = np.where(wanted, session.planned_quaternion, session.quaternion[row])
    codes, which = np.unique(session.state, return_inverse=True)
    states = [State(int(code)) for code in codes]
    verdicts = tuple(Verdict(False if state in WRONG else None, f"Controller: {state.name}") for state in states)
    unknown = ~np.isfinite(position).all(axis=1)
    if unknown.any():  # nothing was known before, or ever
        somewhere = session.pose_at(int(np.argmax(unknown)))
        position[unknown], quaternion[unknown] = somewhere.position, somewhere.quaternion
    drawn = chord_tension(session.robot, Pose.from_quaternion(position, quaternion), session.length)
    return Course(
        session.robot, "log", session.time, position, quaternion, session.tension, "measured", drawn, session.length,
        which.astype(np.intp), verdicts,
    )  # fmt: skip
