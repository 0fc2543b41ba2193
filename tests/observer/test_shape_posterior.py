"""What the object is, from the whole stream of beliefs."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from haptic_env import shapes
from observer import HapticSLAM, ShapePosterior, TruePose, shape_posterior
from observer.shape_posterior import FAR, FIELD_EXTENT, FIELD_RESOLUTION


@numba.njit
def _distance(hypotheses, h, x, y, z):
    return shape_posterior._distance(hypotheses, h, x, y, z)


def _told(posterior: ShapePosterior, beliefs, seed: int = 0) -> np.ndarray:
    posterior.reset(seed=seed)
    for belief in beliefs:
        posterior.update(belief)
    return posterior.posterior


def test_uniform_before_anything_is_felt(two_finger):
    posterior = ShapePosterior(two_finger)
    assert posterior.labels == tuple(shapes.SHAPES)
    np.testing.assert_allclose(posterior.posterior, 1 / len(shapes.SHAPES))
    np.testing.assert_allclose(posterior.reset(seed=0), 1 / len(shapes.SHAPES))
    slam = HapticSLAM(two_finger, particles=4)
    np.testing.assert_allclose(posterior.update(slam.reset(seed=0)), 1 / len(shapes.SHAPES))


@pytest.mark.parametrize("shape", shapes.SHAPES)
def test_the_shape_is_named_at_the_true_pose(explore, shape):
    trial = explore(shape, 500, sigma_deg=0.0, motor_noise=0.0)
    posterior = ShapePosterior(trial.hand)
    told = _told(posterior, trial.beliefs(TruePose(trial.hand), truth=True))
    assert told.shape == (4,)
    assert told.sum() == pytest.approx(1)
    assert posterior.labels[told.argmax()] == shape
    assert told.max() > 0.9


def test_the_same_seed_is_the_same_bits(explore):
    trial = explore("cube", 100, sigma_deg=3.0)
    beliefs = trial.beliefs(HapticSLAM(trial.hand, 3.0, particles=8))
    posterior = ShapePosterior(trial.hand)
    runs = [_told(posterior, beliefs, seed) for seed in (0, 0, 1)]
    assert runs[0].tobytes() == runs[1].tobytes()
    assert runs[0].tobytes() != runs[2].tobytes()


def test_several_solids_of_a_label_have_their_mean_likelihood(explore):
    trial = explore("cube", 150, sigma_deg=0.0, motor_noise=0.0)
    beliefs = trial.beliefs(TruePose(trial.hand), truth=True)
    solids = [shapes.make("cube"), shapes.make("cube", (0.04, 0.04, 0.04)), shapes.make("sphere")]
    apart = ShapePosterior(trial.hand, {"first": solids[:1], "second": solids[1:2], "third": solids[2:]})
    together = ShapePosterior(trial.hand, {"any": [solids[0], solids[2]], "other": solids[1:2]})
    likelihood = _told(apart, beliefs)
    mixed = _told(together, beliefs)
    expected = np.array([(likelihood[0] + likelihood[2]) / 2, likelihood[1]])
    np.testing.assert_allclose(mixed, expected / expected.sum(), rtol=1e-9)


def test_a_label_that_is_there_twice_is_no_more_probable(explore):
    trial = explore("cube", 150, sigma_deg=0.0, motor_noise=0.0)
    beliefs = trial.beliefs(TruePose(trial.hand), truth=True)
    one = ShapePosterior(trial.hand, {name: [shapes.make(name)] for name in ("cube", "sphere")})
    two = ShapePosterior(trial.hand, {"cube": [shapes.make("cube")] * 2, "sphere": [shapes.make("sphere")]})
    np.testing.assert_allclose(_told(one, beliefs), _told(two, beliefs), rtol=1e-9)


@pytest.mark.parametrize("shape", shapes.SHAPES)
def test_moved_turned_and_scaled_solids_keep_their_distance(shape):
    """The kernel's field of one size, read at the hypothesis's pose, against the solid's own signed distance."""
    rng = np.random.default_rng(0)
    size = np.asarray(shapes.SHAPES[shape].default_size)
    solids = [
        shapes.make(shape, scale * size, rng.uniform(-0.02, 0.02, 3), rng.standard_normal(4)) for scale in (1, 0.8, 1.3)
    ]
    hypotheses = shape_posterior._hypotheses(solids)
    assert len(hypotheses.field) == 1, "one shape, one field"
    for h, solid in enumerate(solids):
        points = np.asarray(solid.position) + rng.uniform(-0.04, 0.04, (300, 3))
        got = np.array([_distance(hypotheses, h, *point) for point in points])
        scale = solid.size[0] / solids[0].size[0]
        # The nearest node of the field is at most half a diagonal away; a distance changes no faster than its place.
        assert np.abs(got - solid.signed_distance(points)).max() <= 0.5 * 3**0.5 * FIELD_RESOLUTION * scale + 1e-6


def test_shapes_of_other_proportions_have_fields_of_their_own():
    solids = [shapes.make("cube"), shapes.make("cube", (0.05, 0.05, 0.03)), shapes.make("sphere"), shapes.make("cube")]
    hypotheses = shape_posterior._hypotheses(solids)
    np.testing.assert_array_equal(hypotheses.drawn_in, [0, 1, 2, 0])


def test_far_from_the_object_nothing_is_near():
    hypotheses = shape_posterior._hypotheses([shapes.make("cube", position=(0.1, 0, 0))])
    assert _distance(hypotheses, 0, 0.1 + 0.6 * FIELD_EXTENT, 0.0, 0.0) >= FAR


@pytest.mark.parametrize("candidates", [{}, {"cube": []}, {"cube": [shapes.make("cube")], "sphere": []}])
def test_candidates_without_a_solid_are_refused(two_finger, candidates):
    with pytest.raises(ValueError, match="each label at least one solid, got"):
        ShapePosterior(two_finger, candidates)


@pytest.mark.parametrize(
    ("name", "value"),
    [("samples", 0), ("samples", 1.5), ("tolerance", 0.0), ("tolerance", np.nan), ("surprise", 0.0), ("temper", 1.1)],
)
def test_impossible_settings_are_refused(two_finger, name, value):
    with pytest.raises(ValueError, match=f"{name} must be .* got {value}"):
        ShapePosterior(two_finger, **{name: value})
