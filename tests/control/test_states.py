"""The table of states against section 13's, and what it refuses."""

import pytest

from sagline.control.states import OWNING, TABLE, RefusedError, State, check_transition


def test_every_state_has_one_row_in_the_order_of_the_codes() -> None:
    assert list(TABLE) == list(State)


def test_every_state_that_holds_a_grant_and_is_no_end_stops_on_a_fault() -> None:
    after = {State.STOPPING, State.FAULT, State.EMERGENCY}
    for state in OWNING - after:
        assert State.STOPPING in TABLE[state][1]


def test_every_state_with_a_grant_leads_to_emergency_and_only_off_leads_away() -> None:
    for state in OWNING - {State.EMERGENCY}:  # while it connects the brakes are on: it is refused
        assert State.EMERGENCY in TABLE[state][1]
    assert list(TABLE[State.EMERGENCY][1]) == [State.OFF]
    assert list(TABLE[State.OFF][1]) == [State.CONNECTING]


def test_nothing_moves_a_robot_whose_place_is_not_known() -> None:
    """Only homing, or a place that is still known, leads to where paths begin."""
    assert [state for state in State if State.MOVING in TABLE[state][1]] == [State.IDLE]
    assert {state for state in State if State.IDLE in TABLE[state][1]} == {
        State.READY,
        State.HOMING,
        State.MOVING,
        State.JOGGING,
        State.PAUSING,
        State.STOPPING,
    }


def test_what_is_not_listed_is_refused_in_one_line_with_the_ways_that_there_are() -> None:
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
