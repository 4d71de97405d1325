"""Functions for PyTorch, compared with those of sagline and of JAX; the derivatives also with differences.

The environment of `make env` does not contain PyTorch, because its package of 3 GB contains libraries for graphics
processors. `tests/kinematics/test_differentiable.py` tests all of the functions except the calls of PyTorch.
"""

import doctest
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest

import sagline as sl
import sagline.jax as sj
from tests.refusal import refused
from tests.shifted import CASES, COGIRO, FORWARD, POSE, SLANTED, Shifted
from tests.tiers import wide
from tools.pages.snippets import executed

torch: Any = pytest.importorskip("torch", reason="PyTorch is not installed")
st: Any = pytest.importorskip("sagline.torch")
jax.config.update("jax_enable_x64", True)
func: Any = torch.func
pytestmark = pytest.mark.filterwarnings("ignore:.torch.jit.script. is deprecated:FutureWarning")  # a call of PyTorch's
PAGE = Path(__file__).parents[1] / "docs" / "howto" / "torch.md"
NOT_RUN = "<!-- not run: the environment has no PyTorch -->\n"


def tensors(arguments: dict[str, Any]) -> list[Any]:
    """Copies of arrays as tensors with gradients."""
    return [torch.tensor(np.array(each), requires_grad=True) for each in arguments.values()]


def forward_of(robot: sl.Robot, pose: sl.Pose) -> Callable[..., Any]:
    """Positions, quaternions and tensions as function of lengths, wrench and anchors."""

    def of(lengths: Any, wrench: Any, frame: Any, platform: Any) -> Any:
        return tuple(st.forward(robot, lengths, pose, wrench, frame_anchors=frame, platform_anchors=platform))

    return of


def inverse_of(robot: sl.Robot) -> Callable[..., Any]:
    """Lengths and tensions as function of position, quaternion, wrench and anchors."""

    def of(position: Any, quaternion: Any, wrench: Any, frame: Any, platform: Any) -> Any:
        place = st.Forward(position, quaternion, None)
        return tuple(st.inverse(robot, place, wrench, frame_anchors=frame, platform_anchors=platform))

    return of


# one case of forward, then one of inverse, in the first tier
ALL = [(True, *FORWARD[0]), *((False, *case) for case in CASES.values()), *((True, *case) for case in FORWARD[1:])]


@pytest.mark.parametrize(("is_forward", "robot", "pose"), wide(ALL, first=0))
def test_results_and_gradients_are_those_of_sagline_and_of_jax(
    is_forward: bool, robot: sl.Robot, pose: sl.Pose
) -> None:
    case = Shifted(robot, pose)
    arguments, _ = case.arguments_of_forward() if is_forward else case.arguments_of_inverse()
    of = forward_of(robot, pose) if is_forward else inverse_of(robot)
    given = tensors(arguments)
    found = torch.cat(of(*given))
    direct = case.forward(0.0) if is_forward else case.inverse(0.0)
    np.testing.assert_allclose(found.detach().numpy(), direct, rtol=1e-12, atol=1e-12)
    weights = np.random.default_rng(1).normal(size=len(direct))
    found.backward(torch.tensor(weights))

    def in_jax(values: tuple[Any, ...]) -> Any:
        first, *rest = values
        names = ("wrench", "frame_anchors", "platform_anchors")
        if is_forward:
            return jax.numpy.concatenate(sj.forward(robot, first, pose, **dict(zip(names, rest, strict=True))))
        place = sj.Forward(first, rest[0], None)
        return jax.numpy.concatenate(sj.inverse(robot, place, **dict(zip(names, rest[1:], strict=True))))

    expected = jax.grad(lambda values: weights @ in_jax(values))(tuple(map(np.array, arguments.values())))
    for tensor, other in zip(given, expected, strict=True):
        np.testing.assert_allclose(tensor.grad.numpy(), other, rtol=1e-10, atol=1e-12 * np.abs(other).max())


@pytest.mark.parametrize(("is_forward", "robot", "pose"), wide(ALL, first=2))
def test_gradients_are_those_of_differences(is_forward: bool, robot: sl.Robot, pose: sl.Pose) -> None:
    case = Shifted(robot, pose)
    arguments, _ = case.arguments_of_forward() if is_forward else case.arguments_of_inverse()
    of = forward_of(robot, pose) if is_forward else inverse_of(robot)
    index = list(arguments).index("wrench")
    arguments["wrench"] = 1e-3 * arguments["wrench"]  # kN, so that all derivatives have similar magnitudes

    def scaled(*given: Any) -> Any:
        *first, tension = of(*given[:index], 1e3 * given[index], *given[index + 1 :])
        return *first, 1e-5 * tension

    assert torch.autograd.gradcheck(scaled, tensors(arguments), eps=1e-6, atol=1e-6, rtol=1e-6, check_forward_ad=True)


def test_target_tensions_have_gradients() -> None:
    goals = torch.tensor(np.random.default_rng(4).uniform(200.0, 900.0, (3, 8)), requires_grad=True)
    assert torch.autograd.gradcheck(
        lambda goal: tuple(st.inverse(COGIRO, POSE, target=goal)), [goals], eps=0.1, atol=1e-8, rtol=1e-6
    )


def test_leading_axes_are_broadcast_and_gradients_are_summed_over_them() -> None:
    rng = np.random.default_rng(2)
    lengths = torch.tensor(
        sl.inverse(COGIRO, POSE).unstrained_length + 1e-3 * rng.normal(size=(4, 1, 8)), requires_grad=True
    )
    wrench = torch.tensor(50.0 * rng.normal(size=(3, 6)), requires_grad=True)
    found = st.forward(COGIRO, lengths, POSE, wrench)
    assert found.position.shape == (4, 3, 3)
    found.tension.square().sum().backward()
    sums = np.zeros((4, 8)), np.zeros((3, 6))
    for i in range(4):
        for k in range(3):
            one, load = (each.detach().clone().requires_grad_() for each in (lengths[i, 0], wrench[k]))
            alone = st.forward(COGIRO, one, POSE, load)
            np.testing.assert_array_equal(alone.tension.detach(), found.tension[i, k].detach())
            alone.tension.square().sum().backward()
            sums[0][i] += one.grad.numpy()
            sums[1][k] += load.grad.numpy()
    np.testing.assert_allclose(lengths.grad.numpy()[:, 0], sums[0], rtol=1e-12)
    np.testing.assert_allclose(wrench.grad.numpy(), sums[1], rtol=1e-10)


@pytest.mark.parametrize(
    "change",
    [
        lambda values: torch.stack([values, values], dim=-1)[..., 0],  # not contiguous
        lambda values: values.T.contiguous().T,
        lambda values: values.flip(0).flip(0),
    ],
)
def test_memory_layouts_do_not_change_results(change: Callable[[Any], Any]) -> None:
    poses = sl.Pose.from_euler([[1.0, 1.0, 2.0], [0.0, 0.5, 1.5]], 0.1, 0.05, 0.2)
    plain = sl.inverse(COGIRO, poses, tension=sl.QuadraticProgram()).unstrained_length
    position = change(torch.tensor(np.array(poses.position)))
    quaternion = change(torch.tensor(np.array(poses.quaternion)))
    found = st.inverse(COGIRO, st.Forward(position, quaternion, None))
    np.testing.assert_allclose(found.unstrained_length, plain, rtol=1e-12)
    np.testing.assert_array_equal(st.inverse(COGIRO, poses).unstrained_length, found.unstrained_length)


def test_an_empty_batch_has_empty_results_and_gradients() -> None:
    lengths = torch.zeros((2, 0, 8), dtype=torch.float64, requires_grad=True)
    found = st.forward(COGIRO, lengths, POSE)
    assert found.tension.shape == (2, 0, 8)
    found.tension.sum().backward()
    assert lengths.grad.shape == (2, 0, 8)


def test_samples_without_a_solution_are_nan_with_their_gradients() -> None:
    far = torch.tensor([[1.0, 1.0, 2.0], [30.0, 0.0, 1.0]], dtype=torch.float64, requires_grad=True)
    found = st.inverse(COGIRO, st.Forward(far, POSE.quaternion, None))
    found.tension.sum().backward()
    for values in (found.unstrained_length, found.tension, far.grad):
        assert values.isfinite().all(dim=-1).tolist() == [True, False]
        assert values[1].isnan().all()


def test_the_transforms_of_torch_func_work() -> None:
    def position(lengths: Any) -> Any:
        return st.forward(COGIRO, lengths, POSE).position

    rng = np.random.default_rng(7)
    lengths = torch.tensor(sl.inverse(COGIRO, POSE).unstrained_length + 1e-3 * rng.normal(size=(2, 3, 8)))
    values = func.vmap(func.vmap(position), in_dims=1, out_dims=1)(lengths)
    np.testing.assert_array_equal(values, position(lengths))
    slopes = func.vmap(func.vmap(func.jacrev(position)))(lengths)
    np.testing.assert_allclose(slopes, func.vmap(func.vmap(func.jacfwd(position)))(lengths), rtol=1e-10, atol=1e-14)
    for i in range(2):
        for k in range(3):
            expected = jax.jacrev(lambda one: sj.forward(COGIRO, one, POSE).position)(lengths[i, k].numpy())
            np.testing.assert_allclose(slopes[i, k], expected, rtol=1e-10, atol=1e-14)


def test_forward_after_inverse_is_the_identity() -> None:
    positions = torch.tensor(POSE.position + np.random.default_rng(6).uniform(-0.2, 0.2, (5, 3)))

    def around(position: Any) -> Any:
        lengths = st.inverse(COGIRO, st.Forward(position, POSE.quaternion, None)).unstrained_length
        return st.forward(COGIRO, lengths, POSE).position

    np.testing.assert_allclose(around(positions), positions, rtol=0.0, atol=1e-12)
    slopes = func.vmap(func.jacrev(around))(positions)
    np.testing.assert_allclose(slopes, np.broadcast_to(np.eye(3), (5, 3, 3)), rtol=0.0, atol=1e-9)


def test_second_derivatives_are_refused_in_one_line() -> None:
    def height(lengths: Any) -> Any:
        return st.forward(COGIRO, lengths, POSE).position[2]

    lengths = torch.tensor(sl.inverse(COGIRO, POSE).unstrained_length, requires_grad=True)
    (slope,) = torch.autograd.grad(height(lengths), lengths, create_graph=True)
    assert slope.isfinite().all()
    calls: list[Callable[[], object]] = [
        lambda: slope.sum().backward(),
        lambda: func.hessian(height)(lengths.detach()),
        lambda: func.jacrev(func.jacrev(height))(lengths.detach()),
        lambda: func.jacfwd(func.jacfwd(height))(lengths.detach()),
    ]
    for call in calls:
        with refused("the order of the derivative", "2"):
            call()


def ones(*shape: int, **more: Any) -> Any:
    """Tensor of ones."""
    return torch.ones(shape, **{"dtype": torch.float64, **more})


BAD: dict[str, tuple[Callable[[], object], tuple[str | None, ...]]] = {
    "single precision": (
        lambda: st.forward(COGIRO, ones(8, dtype=torch.float32), POSE),
        ("unstrained_length", "of torch.float32", "torch.float64", "Call unstrained_length.double()."),
    ),
    "integers": (
        lambda: st.inverse(COGIRO, POSE, ones(6, dtype=torch.int64)),
        ("wrench", "of torch.int64", "torch.float64", None),
    ),
    "device": (
        lambda: st.inverse(COGIRO, POSE, target=ones(8, device="meta")),
        ("target", "on meta", "a tensor on cpu", "Call target.cpu()."),
    ),
    "lengths": (
        lambda: st.forward(COGIRO, ones(3, 7), POSE),
        ("unstrained_length", "of shape (3, 7)", "shape (..., 8)", "Reshape unstrained_length."),
    ),
    "a number": (lambda: st.forward(COGIRO, 1.0, POSE), ("unstrained_length", "of shape ()", None, None)),
    "anchors": (
        lambda: st.forward(COGIRO, ones(8), POSE, platform_anchors=np.ones((3, 8))),
        ("platform_anchors", "of shape (3, 8)", "shape (..., 8, 3)", None),
    ),
    "position": (
        lambda: st.inverse(COGIRO, st.Forward(np.zeros(2), POSE.quaternion, None)),
        ("position", "of shape (2,)", "shape (..., 3)", None),
    ),
    "text": (lambda: st.inverse(COGIRO, POSE, "none"), ("wrench", "'none'", "numbers", None)),
    "leading axes": (
        lambda: st.forward(COGIRO, ones(2, 8), POSE, ones(3, 6)),
        ("leading axes", "(2,), (3,)", "shapes that broadcast", "Give all arguments the same leading axes, or none."),
    ),
    "straight cables": (lambda: st.inverse(COGIRO, POSE, model="straight"), ("model", "Straight()", None, None)),
    "model": (lambda: st.forward(COGIRO, ones(8), POSE, model=[]), ("model", None, None, None)),
    "slanted axes": (lambda: st.inverse(SLANTED, POSE), ("winches: swivel_axis[0]", None, "up or down here", None)),
    "robot": (lambda: st.forward(["cogiro"], ones(8), POSE), ("robot", None, None, None)),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_arguments_are_refused_in_one_line(name: str) -> None:
    call, parts = BAD[name]
    with refused(*parts):
        call()


def test_importing_sagline_does_not_import_torch() -> None:
    code = "import sys, numpy as np, sagline as sl; sl.inverse(sl.load_robot('cogiro'), sl.Pose((0, 0, 1), np.eye(3)))"
    subprocess.run([sys.executable, "-c", f"{code}; sys.exit('torch' in sys.modules)"], check=True)


def test_the_examples_of_the_docstrings_and_of_the_page_print_what_they_say() -> None:
    assert doctest.testmod(st) == (0, 12)
    page = PAGE.read_text(encoding="utf-8").replace(NOT_RUN, "").replace('title="prints"', 'title="output"')
    assert executed(page, PAGE.name) == page
