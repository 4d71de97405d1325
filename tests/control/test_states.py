"""The table of states compared with section 13 of the model, and refusals."""

import pytest

from sagline.control.states import OWNING, TABLE, RefusedError, State, check_transition


def test_every_state_has_one_row_in_the_order_of_the_codes() -> None:
    assert list(TABLE) == list(State)


def test_states_with_a_grant_stop_on_a_fault() -> None:
    after = {State.STOPPING, State.FAULT, State.EMERGENCY}
    for state in OWNING - after:
        assert State.STOPPING in TABLE[state][1]


def test_states_with_a_grant_lead_to_emergency_until_off() -> None:
    for state in OWNING - {State.EMERGENCY}:  # refused while connecting, when the brakes are on
        assert State.EMERGENCY in TABLE[state][1]
    assert list(TABLE[State.EMERGENCY][1]) == [State.OFF]
    assert list(TABLE[State.OFF][1]) == [State.CONNECTING]


def test_a_robot_with_an_unknown_pose_does_not_move() -> None:
    """Only homing, or a pose that is still known, leads to the states in which paths start."""
    assert [state for state in State if State.MOVING in TABLE[state][1]] == [State.IDLE]
    assert {state for state in State if State.IDLE in TABLE[state][1]} == {
        State.READY,
        State.HOMING,
        State.MOVING,
        State.JOGGING,
        State.PAUSING,
        State.STOPPING,
    }


def test_other_transitions_are_refused_with_the_valid_ones() -> None:
    for state in State:
        for to in State:
            if to in TABLE[state][1]:
                check_transition(state, to, "it")
                continue
            with pytest.raises(RefusedError) as caught:
                check_transition(state, to, "it")
            line = str(caught.value)
            assert len(line) < 300
            assert caught.value.item == "it"
            assert all(exit.name in caught.value.next_step for exit in TABLE[state][1])
