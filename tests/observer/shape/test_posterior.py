"""What the object is, from the whole stream of beliefs."""

from __future__ import annotations

import dataclasses

import numba
import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation
from scipy.special import betaln

from haptic_env import hands, shapes
from haptic_env.shapes.base import Solid, rotation_matrix
from observer import HapticSLAM, ShapePosterior, TruePose
from observer.kinematics import link_frames, tree_of
from observer.shape.contact_likelihood import (
    THIN,
    PoseSamples,
    TouchModel,
    contact_likelihood,
    resample,
    weigh,
)
from observer.shape.distance_fields import box_of, field_distance, solids_of
from observer.shape.drawn_fields import FIELD_RESOLUTION
from observer.shape.hypotheses import Variants
from observer.shape.link_gaps import patch_gaps
from observer.shape.null_model import NullModel
from observer.shape.skin import SKIN_SPACING, skin_of
from observer.shape.subchains import parts_of
from observer.surface.felt_shape import FeltShape
from observer.surface.mesh import Surface

UNKNOWN = {"size_jitter": 0.2, "yaw_jitter": 45.0, "position_jitter": 0.005}
FAR = 0.05


@numba.njit
def _distance(solids, h, x, y, z):
    box = box_of(solids, solids.drawn_in[h])
    return field_distance(solids.nodes, box, solids.resolution, solids.far, x, y, z)


@numba.njit
def _gaps(solids, h, skin, link, position, rotation, clear, gaps):
    return patch_gaps(solids, h, skin, link, (position, rotation), clear, gaps) < clear


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


def test_candidates_may_be_names(two_finger):
    names = ["torus( .4 )", "cube(size=0.04)", "sphere"]
    posterior = ShapePosterior(two_finger, names, rotation_jitter=180, variants=2)
    assert posterior.labels == ("torus(0.4)", "cube(size=0.04)", "sphere")
    same = {name: [shapes.make(name, position=two_finger.grasp_centre)] for name in posterior.labels}
    posterior.reset(seed=1)
    other = ShapePosterior(two_finger, same, rotation_jitter=180, variants=2)
    other.reset(seed=1)
    for mine, theirs in zip(posterior.hypotheses.solids, other.hypotheses.solids, strict=True):
        np.testing.assert_array_equal(mine, theirs)


@pytest.mark.parametrize(
    ("names", "told"),
    [
        (["cube", "trous(0.4)"], "unknown candidate 'trous\\(0.4\\)'"),
        (["torus(7)"], "tube must be"),
        (["torus(0.4)", "torus(0.40)"], "each there once"),
        ([], "a list of names"),
        ("cube", "a list of names"),
    ],
)
def test_names_that_are_no_candidates_are_refused(two_finger, names, told):
    with pytest.raises(ValueError, match=told):
        ShapePosterior(two_finger, names)


@pytest.mark.parametrize("shape", shapes.SHAPES)
def test_the_shape_is_named_at_the_true_pose(explore, shape):
    trial = explore(shape, 500, sigma_deg=0.0, motor_noise=0.0)
    posterior = ShapePosterior(trial.hand)
    told = _told(posterior, trial.beliefs(TruePose(trial.hand), truth=True))
    assert told.shape == (4,)
    assert told.sum() == pytest.approx(1)
    assert posterior.labels[told.argmax()] == shape
    assert told.max() > 0.9


@pytest.mark.parametrize("shape", ["cube", "sphere"])
def test_one_sample_is_the_mean_pose_and_leaves_nothing_to_chance(explore, shape):
    trial = explore(shape, 400, sigma_deg=3.0)
    beliefs = trial.beliefs(HapticSLAM(trial.hand, 3.0, particles=1, candidates=1))
    posterior = ShapePosterior(trial.hand, samples=1, stride=3)
    runs = [_told(posterior, beliefs, seed) for seed in (0, 1)]
    assert runs[0].tobytes() == runs[1].tobytes()
    assert posterior.labels[runs[0].argmax()] == shape


def test_what_is_not_known_of_the_mean_pose_widens_the_tolerance(explore):
    """So a solid that lies three tolerances away from a touch is the less improbable the less the pose is known."""
    trial = explore("cube", 300, sigma_deg=3.0)
    beliefs = trial.beliefs(HapticSLAM(trial.hand, 3.0, particles=1, candidates=1))
    candidates = {"there": [shapes.make("cube")], "beside": [shapes.make("cube", position=(0.0, 0.0, 0.006))]}
    posterior = ShapePosterior(trial.hand, candidates, samples=1)
    sure = _told(posterior, beliefs)
    unsure = _told(
        posterior, [dataclasses.replace(each, lagged_covariance=25.0 * each.lagged_covariance) for each in beliefs]
    )
    assert sure[0] > unsure[0] > 0.5


def test_the_same_seed_is_the_same_bits(explore):
    trial = explore("cube", 100, sigma_deg=3.0)
    beliefs = trial.beliefs(HapticSLAM(trial.hand, 3.0, particles=8))
    posterior = ShapePosterior(trial.hand, samples=16)
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
    """The field of one size, read at the hypothesis's pose, against the solid's own signed distance."""
    rng = np.random.default_rng(0)
    size = np.asarray(shapes.SHAPES[shape].default_size)
    made = [
        shapes.make(shape, scale * size, rng.uniform(-0.02, 0.02, 3), rng.standard_normal(4)) for scale in (1, 0.8, 1.3)
    ]
    solids = solids_of(made, FAR)
    assert len(solids.shape) == 1, "one shape, one field"
    for h, solid in enumerate(made):
        points = np.asarray(solid.position) + rng.uniform(-0.04, 0.04, (300, 3))
        local = (points - solids.position[h]) @ solids.rotation[h] / solids.scale[h]
        got = solids.scale[h] * np.array([_distance(solids, h, *point) for point in local])
        # Exact but where a plane bends between nodes.
        error = np.abs(got - solid.signed_distance(points))
        assert error.max() < 0.5 * FIELD_RESOLUTION
        assert np.median(error) < 0.05 * FIELD_RESOLUTION


def test_shapes_of_other_proportions_have_fields_of_their_own():
    made = [shapes.make("cube"), shapes.make("cube", (0.05, 0.05, 0.03)), shapes.make("sphere"), shapes.make("cube")]
    np.testing.assert_array_equal(solids_of(made, FAR).drawn_in, [0, 1, 2, 0])


def test_beyond_its_field_a_solid_is_far():
    solids = solids_of([shapes.make("cube", (0.1, 0.1, 0.1)), shapes.make("cube")], FAR)
    for h in range(2):
        assert solids.scale[h] * _distance(solids, h, -1.01 * solids.low[0, 0], 0.0, 0.0) >= FAR


def _reference_gaps(hand, solid, pose, clear):
    """(P,) least distance of any point of each patch's skin, one by one."""
    skin = hand.patches.surface(SKIN_SPACING)
    position, rotation = link_frames(tree_of(hand), pose)
    world = position[skin.link] + np.einsum("mij,mj->mi", rotation[skin.link], skin.points)
    gaps = np.full(len(hand.patches), np.inf)
    np.minimum.at(gaps, skin.patch, solid.signed_distance(world))
    return np.minimum(gaps, clear)


def _reference_flesh(hand, solid, pose):
    """(L,) how far the flesh about each bone is from the solid, by points of the bone 0.1 mm apart."""
    position, rotation = link_frames(tree_of(hand), pose)
    along = [np.arange(0.0, link.length + 1e-4, 1e-4) for link in hand.links]
    return np.array(
        [
            solid.signed_distance(at + s[:, None] * turn[:, 2]).min() - link.radius
            for at, turn, s, link in zip(position, rotation, along, hand.links, strict=True)
        ]
    )


@pytest.mark.parametrize("shape", shapes.SHAPES)
def test_gaps_are_those_of_the_nearest_points_of_the_skin(two_finger, shape):
    """What is skipped as too far away is too far away."""
    rng = np.random.default_rng(0)
    solid = shapes.make(shape, None, (0.004, 0.002, -0.003), (np.cos(0.2), 0, 0, np.sin(0.2)))
    skin, solids, tree = skin_of(two_finger), solids_of([solid], FAR), tree_of(two_finger)
    clear, near = 0.004, 0
    for _ in range(40):
        pose = rng.uniform(*two_finger.joint_limits.T)
        position, rotation = link_frames(tree, pose)
        gaps = np.full(len(two_finger.patches), clear)
        for link in range(len(two_finger.links)):
            near += _gaps(solids, 0, skin, link, position[link], rotation[link], clear, gaps)
        np.testing.assert_allclose(gaps, _reference_gaps(two_finger, solid, pose, clear), atol=0.5 * FIELD_RESOLUTION)
    assert near > 40


def _likelihood(tree, skin, solids, poses, column, contacts, tolerance, press, surprise):
    out = np.empty((len(column), len(solids.scale), len(poses)))
    each, news = np.full(len(skin.body), tolerance), np.ones(len(skin.body))
    model = TouchModel(each, press, surprise)
    contact_likelihood(tree, skin, solids, PoseSamples(poses, column), contacts, news, model, out)
    return out


def _reference_likelihood(hand, gaps, flesh, contacts, tolerance, press, surprise):
    """(G,) of each finger, link by link, from the `gaps` (P,) of all patches and the `flesh` (L,) of all links."""
    result = np.ones(len(np.unique(hand.link_group)))
    for link, group in enumerate(hand.link_group):
        mine = hand.patches.link == link
        touched, silent = gaps[mine & contacts], gaps[mine & ~contacts].min(initial=4 * tolerance)
        depth = np.where(touched < 0.0, np.minimum(touched + press, 0.0), touched) / tolerance
        fits = list(np.where(depth < 4.0, np.exp(-0.5 * depth**2), 0.0))
        if press > 4.0 * tolerance:
            one_sided = 1.0 / (1.0 + np.exp(1.7 * np.maximum(touched, -press) / tolerance))
            fits = list(np.where(touched < 4.0 * tolerance, one_sided, 0.0))
        if flesh[link] < gaps[mine].min() - THIN:
            silent = flesh[link]
        ratio = silent / tolerance
        if len(touched):
            ratio += 1.0 + (press - touched.min()) / tolerance
        if ratio < 4.0 and gaps[mine].min() < 4 * tolerance:
            fits.append(1.0 / (1.0 + np.exp(-1.7 * ratio)))
        result[group] *= np.prod(surprise + (1.0 - surprise) * np.array(fits))
    return result


@pytest.mark.parametrize("press", [0.0, 0.003, 0.01])
def test_the_likelihood_is_the_product_over_a_fingers_links(two_finger, press):
    rng = np.random.default_rng(1)
    made = [shapes.make("cube"), shapes.make("sphere")]
    skin, solids, tree = skin_of(two_finger), solids_of(made, FAR), tree_of(two_finger)
    poses = rng.uniform(*two_finger.joint_limits.T, (20, two_finger.joints))
    contacts = rng.random(len(two_finger.patches)) < 0.1
    likelihood = (0.002, press, 0.01)
    out = _likelihood(tree, skin, solids, poses, parts_of(two_finger).column, contacts, *likelihood)
    for h, solid in enumerate(made):
        for s, pose in enumerate(poses):
            gaps = _reference_gaps(two_finger, solid, pose, 0.008)
            expected = _reference_likelihood(
                two_finger, gaps, _reference_flesh(two_finger, solid, pose), contacts, *likelihood
            )
            # A gap that is off by a tenth of its tolerance changes the log of one patch by some tenths.
            np.testing.assert_allclose(np.log(out[:, h, s]), np.log(expected), atol=3)
            np.testing.assert_allclose(np.log(out[:, h, s]).sum(), np.log(expected).sum(), rtol=0.1, atol=0.5)


def test_a_thin_wall_cannot_run_through_flesh(two_finger):
    """Between the points of the skin there is room for one, yet not in the link."""
    skin, tree, column = skin_of(two_finger), tree_of(two_finger), parts_of(two_finger).column
    position, rotation = link_frames(tree, two_finger.rest_pose)
    link = len(two_finger.links) - 1
    length, axis = two_finger.links[link].length, rotation[link][:, 2]
    across = np.roll(Rotation.from_matrix(rotation[link]).as_quat(), 1)
    along = np.append(np.linspace(0.2, 0.8, 25) * length, 1.5 * length + 0.02)
    walls = [shapes.make("cube", (0.05, 0.05, 0.005), position[link] + s * axis, across) for s in along]
    silent = np.zeros(len(two_finger.patches), dtype=bool)
    told = tree, skin, solids_of(walls, FAR), two_finger.rest_pose[None], column, silent, 0.001, 0.0, 0.001
    *through, clear = _likelihood(*told)[:, :, 0].prod(axis=0)
    assert max(through) < 0.005
    assert clear > 0.9


@pytest.mark.parametrize(("std", "least", "most"), [(0.0, 0.0, 0.01), (1.0, 0.9, 1.0)], ids=["felt", "not felt"])
def test_flesh_may_be_where_nothing_was_felt(two_finger, std, least, most):
    """Of what was felt in part there is no wall where nothing was felt: a link may lie there."""
    pytest.importorskip("igl")
    skin, tree, column = skin_of(two_finger), tree_of(two_finger), parts_of(two_finger).column
    position, rotation = link_frames(tree, two_finger.rest_pose)
    link = len(two_finger.links) - 1
    box = trimesh.creation.box((0.04, 0.05, 0.06))
    felt = FeltShape(Surface(np.array(box.vertices), np.array(box.faces), np.full(len(box.vertices), std)))
    middle = tuple(position[link] + 0.5 * two_finger.links[link].length * rotation[link][:, 2])
    about = solids_of([Solid("felt", felt, felt.default_size, middle)], FAR)
    silent = np.zeros(len(two_finger.patches), dtype=bool)
    told = _likelihood(tree, skin, about, two_finger.rest_pose[None], column, silent, 0.001, 0.0, 0.001)
    assert least <= told.prod() <= most


def _beside_what_was_felt(hand, std: float, gap: float, *, rings: bool) -> float:
    """How probable it is that the tip of the last link feels contact, or none, `gap` m from a face of a block whose
    surface is known with an SD of `std` m."""
    skin, tree, column = skin_of(hand), tree_of(hand), parts_of(hand).column
    position, rotation = link_frames(tree, hand.rest_pose)
    link = len(hand.links) - 1
    mine = np.arange(skin.begin[skin.first_bead[link]], skin.begin[skin.first_bead[link + 1]])
    tip = mine[skin.points[mine][:, 2].argmax()]
    block = trimesh.creation.box((0.03, 0.03, 0.03)).subdivide().subdivide()
    felt = FeltShape(Surface(np.array(block.vertices), np.array(block.faces), np.full(len(block.vertices), std)))
    place = position[link] + rotation[link] @ (skin.points[tip] + [0.0, 0.0, gap + 0.015])
    turn = np.roll(Rotation.from_matrix(rotation[link]).as_quat(), 1)
    solids = solids_of([Solid("felt", felt, felt.default_size, tuple(place), tuple(turn))], FAR)
    contacts = np.zeros(len(hand.patches), dtype=bool)
    contacts[skin.patch[tip]] = rings
    told = _likelihood(tree, skin, solids, hand.rest_pose[None], column, contacts, 0.001, 0.0, 0.001)
    return float(told.prod())


def test_a_gap_counts_in_what_is_not_known_of_both_the_hand_and_what_was_felt(two_finger):
    """Neither a touch nor silence a few millimetres beside a surface that is known no better is held against it; that a
    touch might as well have been elsewhere costs a little."""
    pytest.importorskip("igl")
    off = {std: _beside_what_was_felt(two_finger, std, 0.004, rings=True) for std in (0.0, 0.004)}
    assert off[0.0] < 0.01
    assert off[0.004] > 0.25
    on = {std: _beside_what_was_felt(two_finger, std, 0.0, rings=True) for std in (0.0, 0.004, 0.02)}
    assert on[0.0] > 0.9
    assert on[0.0] > on[0.004] > on[0.02] > 0.2
    inside = {std: _beside_what_was_felt(two_finger, std, -0.003, rings=False) for std in (0.0, 0.004)}
    assert inside[0.0] < 0.02
    assert inside[0.004] > 0.5
    far = _beside_what_was_felt(two_finger, 0.0, 0.3, rings=True)
    assert far == pytest.approx(0.001, rel=1e-6), "as of a known solid that is not near"


def test_silence_says_the_same_of_a_flat_face_as_of_a_point(two_finger):
    """However many patches of a link lie as near as its nearest, it is one event that none of them is touched; and
    beside a touch they say nothing but that they lie no deeper."""
    skin, tree, column = skin_of(two_finger), tree_of(two_finger), parts_of(two_finger).column
    size = np.full(3, 0.2)
    flat, round_ = (shapes.make(name, size, (0.052 + 0.1 + 0.0095, 0.0, 0.0)) for name in ("cube", "sphere"))
    solids = solids_of([flat, round_], FAR)
    pose = np.zeros((1, two_finger.joints))  # the index stands upright along the face
    gaps = [_reference_gaps(two_finger, solid, pose[0], 0.004) for solid in (flat, round_)]
    proximal = two_finger.patches.link == [link.name for link in two_finger.links].index("index_proximal")
    assert (gaps[0][proximal] < 0.001).sum() > (gaps[1][proximal] < 0.001).sum() > 0
    silent = np.zeros(len(two_finger.patches), dtype=bool)
    rings = silent.copy()
    rings[np.flatnonzero(proximal)[gaps[1][proximal].argmin()]] = True
    for contacts, least in ((silent, 0.35), (rings, 0.6)):
        told = _likelihood(tree, skin, solids, pose, column, contacts, 0.001, 0.0, 0.001)
        assert (told[1] > least).all(), "twice as many near patches would halve it again and again"


def test_weights_that_are_resampled_from_the_mixture_keep_every_hypothesis_its_own():
    """Whatever the mixture: means under each hypothesis's weights stay, but for the chance of drawing."""
    rng = np.random.default_rng(0)
    samples = 20_000
    poses = rng.standard_normal((samples, 2))
    weights = np.stack([[np.exp(2.5 * poses[:, j]), np.exp(-1.5 * poses[:, j])] for j in range(2)])
    weights /= weights.sum(axis=-1, keepdims=True)
    before = np.einsum("ghs,sg->gh", weights, poses)
    moved, kept = poses.copy(), weights.copy()
    resample(kept, np.array([0.3, 0.7]), moved, np.arange(2), rng.random(2))
    assert (moved != poses).any()
    np.testing.assert_allclose(kept.sum(axis=-1), 1.0)
    np.testing.assert_allclose(np.einsum("ghs,sg->gh", kept, moved), before, atol=0.05)


def test_evidence_is_the_mean_likelihood_under_the_weights():
    rng = np.random.default_rng(0)
    weights = rng.random((2, 3, 5))
    weights /= weights.sum(axis=-1, keepdims=True)
    likelihood = rng.random(weights.shape)
    expected = np.log((weights * likelihood).sum(axis=-1)).sum(axis=0)
    evidence = np.full(3, 0.5)
    weigh(weights, likelihood, 0.3, evidence)
    np.testing.assert_allclose(evidence - 0.5, 0.3 * expected)
    np.testing.assert_allclose(weights.sum(axis=-1), 1.0)


def _variants(count=200, **ranges):
    return Variants([shapes.make("cube"), shapes.make("cylinder")], count, far=FAR, **{**UNKNOWN, **ranges})


def test_variants_are_what_the_environment_may_draw():
    variants = _variants()
    units = variants.draw(np.random.default_rng(0))
    solids = variants.place(units)
    assert units.shape == (400, 5)
    for values, reach in ((solids.scale - 1, 0.2), (solids.position.ravel(), 0.005)):
        assert np.abs(values).max() == pytest.approx(reach, rel=0.05)
        assert np.abs(values).max() <= reach
        assert np.std(values) == pytest.approx(reach / 3**0.5, rel=0.1)
    yaw = units[:, 1] * np.deg2rad(45)
    for h in (0, 399):
        expected = rotation_matrix([np.cos(yaw[h] / 2), 0, 0, np.sin(yaw[h] / 2)])
        np.testing.assert_allclose(solids.rotation[h], expected, atol=1e-12)
    np.testing.assert_array_equal(solids.drawn_in, np.repeat([0, 1], 200))


def test_nothing_unknown_is_one_variant():
    variants = _variants(64, size_jitter=0.0, yaw_jitter=0.0, position_jitter=0.0)
    assert variants.draw(np.random.default_rng(0)).tolist() == [[0.0] * 5] * 2
    assert variants.move(np.zeros((2, 5)), np.array([0.0, -9.0]), np.random.default_rng(0)) is None


def test_moved_variants_keep_evidence_mean_and_spread():
    rng = np.random.default_rng(0)
    variants = _variants(20_000)
    units = variants.draw(rng)
    log_evidence = -8.0 * (units[:, 0] - 0.2) ** 2 - 20.0 * units[:, 1] ** 2 - np.log(20_000)
    log_evidence[20_000:] = -np.log(20_000)
    weights = np.exp(log_evidence[:20_000])
    total, mean = np.logaddexp.reduce(log_evidence[:20_000]), np.average(units[:20_000], axis=0, weights=weights)
    spread = np.cov(units[:20_000].T, aweights=weights)
    second = units[20_000:].copy()
    source = variants.move(units, log_evidence, rng)
    assert source is not None
    assert np.logaddexp.reduce(log_evidence[:20_000]) == pytest.approx(total)
    np.testing.assert_allclose(units[:20_000].mean(axis=0), mean, atol=0.02)
    # Reflection at the ends of a range narrows what fills it by a few hundredths.
    np.testing.assert_allclose(np.cov(units[:20_000].T), spread, atol=0.03)
    assert np.abs(units).max() <= 1.0
    np.testing.assert_array_equal(units[20_000:], second, "of one solid all are effective: it does not move")
    np.testing.assert_array_equal(source[20_000:], np.arange(20_000, 40_000))


@pytest.mark.parametrize("shape", ["cube", "sphere"])
def test_the_shape_is_named_where_size_and_place_are_unknown(explore, shape):
    trial = explore(shape, 500, sigma_deg=0.0, motor_noise=0.0)
    posterior = ShapePosterior(trial.hand, variants=48, **UNKNOWN)
    told = _told(posterior, trial.beliefs(TruePose(trial.hand), truth=True))
    assert posterior.labels[told.argmax()] == shape


def test_unknown_size_and_place_are_the_same_bits_for_the_same_seed(explore):
    trial = explore("cube", 100, sigma_deg=3.0)
    beliefs = trial.beliefs(HapticSLAM(trial.hand, 3.0, particles=1, candidates=1))
    posterior = ShapePosterior(trial.hand, variants=16, **UNKNOWN)
    runs = [_told(posterior, beliefs, seed) for seed in (0, 0, 1)]
    assert runs[0].tobytes() == runs[1].tobytes()
    assert runs[0].tobytes() != runs[2].tobytes()


def test_the_posterior_does_not_depend_on_the_observers_maps(explore):
    trial = explore("cube", 100, sigma_deg=3.0)
    posterior = ShapePosterior(trial.hand)
    few, many = (
        _told(posterior, trial.beliefs(HapticSLAM(trial.hand, 3.0, **keywords)))
        for keywords in ({"particles": 1, "candidates": 1}, {"particles": 8})
    )
    assert few.tobytes() == many.tobytes()


def test_what_is_none_of_the_candidates_is_said_to_be_none(explore):
    trial = explore("pyramid", 250, sigma_deg=0.0, motor_noise=0.0)
    beliefs = trial.beliefs(TruePose(trial.hand), truth=True)
    solids = {name: [shapes.make(name)] for name in shapes.SHAPES}
    present = ShapePosterior(trial.hand, solids, none=0.2)
    assert present.labels == (*shapes.SHAPES, "none")
    np.testing.assert_allclose(present.posterior, [0.2] * 5)
    assert present.labels[_told(present, beliefs).argmax()] == "pyramid"
    absent = ShapePosterior(trial.hand, {name: solids[name] for name in ("cube", "sphere")}, none=0.2)
    told = _told(absent, beliefs)
    assert told.sum() == pytest.approx(1)
    assert absent.labels[told.argmax()] == "none"


def test_habit_is_the_exact_evidence_of_a_chain_whose_rates_are_unknown():
    """The Beta integral in closed form, whatever the order of the steps."""
    rng = np.random.default_rng(0)
    contacts = rng.random((30, 6)) < 0.3
    habit = NullModel(6)
    for row in contacts:
        habit.update(row)
    before = np.vstack([np.zeros(6, dtype=bool), contacts[:-1]])
    expected = 0.0
    for had, (of, among) in ((~before, NullModel.BEGIN), (before, NullModel.CEASE)):
        changed, stayed = (had & (contacts != before)).sum(), (had & (contacts == before)).sum()
        expected += betaln(of + changed, among - of + stayed) - betaln(of, among - of)
    assert habit.log_likelihood == pytest.approx(expected)


def test_a_candidate_called_none_is_refused_beside_none(two_finger):
    with pytest.raises(ValueError, match=r"must not be called 'none' where none > 0, got none=0\.1"):
        ShapePosterior(two_finger, {"none": [shapes.make("cube")]}, none=0.1)


@pytest.mark.parametrize("candidates", [{}, {"cube": []}, {"cube": [shapes.make("cube")], "sphere": []}])
def test_candidates_without_a_solid_are_refused(two_finger, candidates):
    with pytest.raises(ValueError, match="each label at least one solid, got"):
        ShapePosterior(two_finger, candidates)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("samples", 0),
        ("samples", 1.5),
        ("tolerance", 0.0),
        ("tolerance", np.nan),
        ("surprise", 0.0),
        ("temper", 1.1),
        ("stride", 0),
        ("variants", 0),
        ("none", 1.0),
        ("none", -0.1),
        ("size_jitter", 0.6),
        ("yaw_jitter", -1.0),
        ("position_jitter", np.inf),
    ],
)
def test_impossible_settings_are_refused(two_finger, name, value):
    with pytest.raises(ValueError, match=f"{name} must be .* got {value}"):
        ShapePosterior(two_finger, **{name: value})


def test_the_belief_of_another_hand_is_refused():
    other = hands.make("adroit")
    slam = HapticSLAM(other, particles=1, lag=0)
    slam.reset(seed=0)
    belief = slam.step(np.zeros(other.joints), other.rest_pose, np.zeros(len(other.patches)))
    with pytest.raises(ValueError, match=r"'two_finger', with 8 joints and .*, got one of a hand with 24 and"):
        ShapePosterior(hands.make("two_finger")).update(belief)


WRONG = {name: [np.nan, None, "x", np.zeros(3)] for name in ("lagged_covariance", "mean", "rest")} | {
    name: [np.nan, "x", np.zeros(3)]  # None while the lag fills up, and of a hand that does not move as a whole
    for name in ("lagged_contacts", "lagged_root", "transition")
}
WRONG["lagged_joint_angles"] = [np.full(8, np.nan), np.full(8, np.inf), np.zeros(3)]


@pytest.fixture(scope="module")
def twins(two_finger):
    """Two posteriors that are the same."""
    return ShapePosterior(two_finger, stride=1), ShapePosterior(two_finger, stride=1)


@pytest.mark.parametrize(("what", "value"), [(what, value) for what, values in WRONG.items() for value in values])
def test_beliefs_that_cannot_be_are_refused_and_change_nothing(two_finger, twins, what, value):
    slam = HapticSLAM(two_finger, particles=1, lag=0)
    posterior, other = twins
    for each in (slam, posterior, other):
        each.reset(seed=0)
    belief = slam.step(np.zeros(two_finger.joints), two_finger.rest_pose, np.zeros(len(two_finger.patches)))
    of = {"transition": belief.transition._replace(**{what: value})} if what in ("mean", "rest") else {what: value}
    with pytest.raises(ValueError, match=r"must .* got"):
        posterior.update(dataclasses.replace(belief, **of))
    assert np.array_equal(posterior.update(belief), other.update(belief))
