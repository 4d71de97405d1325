"""Statuses are the codes of the kernels, each with a sentence."""

import pickle

import pytest

import sagline as sl
from sagline.core.results import Status
from sagline.kernels import codes

# kernels do not return NO_POSE: invalid poses do not reach them
PREFIX = {sl.CableStatus: "CABLE_", sl.PoseStatus: "POSE_", sl.ForwardStatus: "FORWARD_"}


@pytest.mark.parametrize("kind", PREFIX)
def test_every_code_has_a_status_and_every_status_a_sentence(kind: type[Status]) -> None:
    known = {
        name.removeprefix(PREFIX[kind]): code for name, code in vars(codes).items() if name.startswith(PREFIX[kind])
    }
    assert {status.name: int(status) for status in kind if status is not sl.PoseStatus.NO_POSE} == known
    assert [kind(int(status)) for status in kind] == list(kind)
    assert len({status.text for status in kind}) == len(kind)
    for status in kind:
        assert len(status.text) > 5
        assert pickle.loads(pickle.dumps(status)) is status
    with pytest.raises(ValueError, match="99"):
        kind(99)
