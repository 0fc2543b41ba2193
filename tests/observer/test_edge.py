"""What an observer refuses: what cannot be, before anything is done with it."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from haptic_env import hands, shapes
from haptic_env.grid import Grid
from observer import (
    ContactDynamics,
    ContactModel,
    DeadReckoning,
    HapticSLAM,
    Kalman,
    PoseOnly,
    ShapePosterior,
    warm_up,
)
from observer.kinematics import link_frames, tree_of
from observer.pose.motions import MOTIONS

OBSERVERS = {
    "haptic_slam": lambda hand: HapticSLAM(hand, particles=2, lag=1),
    "sample": lambda hand: HapticSLAM(hand, particles=2, lag=1, matching="sample"),
    "kinematic": lambda hand: HapticSLAM(hand, particles=2, lag=1, motion="kinematic"),
    "paper": lambda hand: HapticSLAM.paper(hand, particles=2),
    "floor": DeadReckoning,
    "kalman": Kalman,
    "pose_only": PoseOnly,
}


@pytest.fixture(scope="module", params=OBSERVERS)
def made(request, two_finger):
    """Each kind of observer."""
    return OBSERVERS[request.param](two_finger)


@pytest.fixture
def watching(made):
    """Each kind of observer, at the start of a trial."""
    made.reset(seed=0)
    return made


TOO_MUCH = {
    "a million radians": (0, 1e6, r"joint_angles must lie in \[-12\.5664, 12\.5664\] radians, got 1000000\.0 at '{}'"),
    "degrees": (0, -45.0, r"joint_angles must lie in .* radians, got -45\.0 at '{}'"),
    "an angle beyond all": (0, 1e300, r"joint_angles must lie in .* radians, got 1e\+300 at '{}'"),
    "an angle that is none": (0, np.inf, "joint_angles must be finite .* got inf at '{}'"),
    "a torque": (1, 1.5, r"torque must lie in \[-1, 1\], got 1\.5 at '{}'"),
    "a torque beyond all": (1, -1e300, r"torque must lie in \[-1, 1\], got -1e\+300 at '{}'"),
    "a torque that is none": (1, np.inf, r"torque must be finite .* got inf at '{}'"),
}


@pytest.mark.parametrize("case", TOO_MUCH)
def test_what_no_hand_feels_or_does_is_refused_by_joint_value_and_range(watching, case):
    which, value, message = TOO_MUCH[case]
    angles, torque = watching.hand.rest_pose.copy(), np.zeros(8)
    (angles, torque)[which][3] = value
    with pytest.raises(ValueError, match=message.format(watching.hand.joint_names[3])):
        watching.step(torque, angles, np.zeros(50))
    if which == 0:
        with pytest.raises(ValueError, match=message.format(watching.hand.joint_names[3])):
            watching.reset(seed=0, joint_angles=angles)


KINDS = {
    "complex": lambda value: value + 0j,
    "masked": lambda value: np.ma.array(value, mask=np.arange(len(value)) == 1),
    "objects": lambda value: np.asarray(value, object),
    "text": lambda value: [str(each) for each in value],
    "of another shape": lambda value: value[:-1],
    "of more dimensions": lambda value: value[None],
    "a number": lambda value: 0.0,
    "nothing": lambda value: None,
}


@pytest.fixture(scope="module")
def slam(two_finger):
    """One for all that is refused."""
    return HapticSLAM(two_finger, particles=1, lag=0)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("which", range(3), ids=["torque", "joint_angles", "contacts"])
def test_arrays_of_other_kinds_are_refused(two_finger, slam, which, kind):
    slam.reset(seed=0)
    given = [np.zeros(8), two_finger.rest_pose, np.zeros(50)]
    given[which] = KINDS[kind](given[which])
    name = ("torque", "joint_angles", "contacts")[which]
    with pytest.raises(ValueError, match=f"{name} must be (finite numbers|0 or 1) .*got"):
        slam.step(*given)


@pytest.mark.filterwarnings("ignore:joint .* where it cannot be:RuntimeWarning")
def test_angles_that_the_observation_space_allows_are_heard(watching):
    """At its very bound, as float32 as the environment has it."""
    for sign in (1, -1):
        belief = watching.step(np.zeros(8), np.float32(sign * np.full(8, 4 * np.pi)), np.zeros(50))
        assert np.isfinite(belief.joint_angles).all()


@pytest.mark.parametrize("seed", [-1, 1.5, "1", np.nan, [1]])
def test_a_seed_that_is_none_is_refused(watching, seed):
    with pytest.raises(ValueError, match="seed must be an integer of at least 0, got"):
        watching.reset(seed=seed)


@pytest.mark.parametrize(
    ("keywords", "told"),
    [
        ({"particles": 10**9}, "particles=1000000000"),
        ({"candidates": 10**9}, "candidates=1000000000"),
        ({"candidates": 10**9, "matching": "sample"}, "candidates=1000000000"),
        ({"lag": 10**5}, "lag=100000"),
        ({"lag": 3000, "motion": "kinematic"}, "lag=3000"),
        ({"particles": 10**12}, "particles=1000000000000"),
        ({"grid": Grid((0, 0, 0), 0.004, (256, 256, 256)), "matching": "sample", "particles": 300}, "16777216 voxels"),
    ],
)
def test_what_does_not_fit_into_the_memory_is_refused(two_finger, keywords, told):
    with pytest.raises(ValueError, match=rf"{told}.* would need .* GiB of memory, more than the 4 GiB"):
        HapticSLAM(two_finger, **keywords)


@pytest.mark.parametrize("stride", [10**5, 10**12])
def test_a_stride_that_does_not_fit_into_the_memory_is_refused(two_finger, stride):
    with pytest.raises(ValueError, match=f"stride={stride} would need .* of memory"):
        PoseOnly(two_finger, stride=stride)


@pytest.mark.parametrize(
    ("keywords", "told"),
    [
        ({"grid": (32, 32, 32)}, r"grid must be a haptic_env\.grid\.Grid, got \(32, 32, 32\)"),
        ({"contact_model": ContactDynamics()}, "contact_model must be a ContactModel, got ContactDynamics"),
        ({"dynamics": ContactModel()}, "dynamics must be a ContactDynamics, got ContactModel"),
    ],
)
def test_parts_of_another_kind_are_refused(two_finger, keywords, told):
    with pytest.raises(ValueError, match=told):
        HapticSLAM(two_finger, **keywords)


@pytest.mark.parametrize("name", ["particles", "candidates", "lag"])
def test_counts_beyond_all_are_refused(two_finger, name):
    with pytest.raises(ValueError, match=rf"{name} must be an integer in \[[01], 1000000000000\], got 10+$"):
        HapticSLAM(two_finger, **{name: 10**30})


@pytest.mark.parametrize("hand", [None, "two_finger", 3, HapticSLAM])
@pytest.mark.parametrize("make", OBSERVERS.values(), ids=OBSERVERS)
def test_what_is_no_hand_is_refused(make, hand):
    with pytest.raises(ValueError, match=r"hand must be a haptic_env\.hand\.Hand, such as env\.unwrapped\.hand, got"):
        make(hand)


def test_raw_angles_have_no_lag(two_finger):
    for lag in (None, 0):
        assert DeadReckoning(two_finger, lag=lag).lag == 0
    with pytest.raises(ValueError, match=r"lag of raw angles must be an integer in \[0, 0\], got 3"):
        DeadReckoning(two_finger, lag=3)


def test_solids_of_another_hand_are_refused(two_finger):
    other = ShapePosterior(hands.make("two_finger", patches_around=6))
    with pytest.raises(ValueError, match="solids must be told of hand 'two_finger'"):
        HapticSLAM(two_finger, solids=other)


@pytest.mark.parametrize("angles", [np.zeros(7), np.zeros(9), np.full(8, np.nan), np.zeros((8, 1)), "rest"])
def test_kinematics_of_angles_that_are_none_are_refused(two_finger, angles):
    with pytest.raises(ValueError, match="joint_angles must be finite numbers"):
        link_frames(tree_of(two_finger), angles)


@pytest.mark.parametrize(
    ("link", "points", "told"),
    [
        ([0, 6], np.zeros((2, 3)), r"link must hold indices in \[0, 5\]"),
        ([-1], np.zeros((1, 3)), r"link must hold indices in \[0, 5\]"),
        ([0], np.zeros((2, 3)), r"points must be of shape \(1, 3\)"),
        ([0], np.full((1, 3), np.nan), "points must be an array of finite numbers"),
    ],
)
def test_patches_of_no_point_are_refused(two_finger, link, points, told):
    with pytest.raises(ValueError, match=told):
        two_finger.patches.locate(np.array(link), points)


@pytest.mark.parametrize(
    "candidates", [{}, 3, {"a": []}, {"a": None}, {"a": ["cube"]}, {3: [shapes.make("cube")]}, [shapes.make("cube")]]
)
def test_what_gives_no_solids_is_refused(two_finger, candidates):
    with pytest.raises(ValueError, match="candidates must give each label at least one solid, got"):
        ShapePosterior(two_finger, candidates)


@pytest.mark.parametrize(
    ("keywords", "told"),
    [
        ({"samples": 10**9}, "samples=1000000000 would need .* GiB"),
        ({"variants": 10**9, "size_jitter": 0.1}, "variants=1000000000 of 1 solids would need .* GiB"),
        ({"tolerance": 0.1}, r"tolerance must be a finite number in \(0, 0.05\] m, got 0.1"),
    ],
)
def test_posteriors_that_do_not_fit_into_the_memory_are_refused(two_finger, keywords, told):
    with pytest.raises(ValueError, match=told):
        ShapePosterior(two_finger, {"cube": [shapes.make("cube")]}, **keywords)


@pytest.mark.parametrize("belief", [None, 3, np.zeros(3), {}])
def test_what_is_no_belief_tells_nothing(two_finger, belief):
    namer = ShapePosterior(two_finger, {"cube": [shapes.make("cube")]})
    with pytest.raises(ValueError, match="belief must be a Belief, as an observer gives, got"):
        namer.update(belief)


@pytest.mark.parametrize("seed", [-1, 1.5, "1", np.nan])
def test_a_posterior_begins_with_a_seed_that_is_one(two_finger, seed):
    with pytest.raises(ValueError, match="seed must be an integer"):
        ShapePosterior(two_finger, {"cube": [shapes.make("cube")]}).reset(seed)


def test_models_of_whole_numbers_are_those_of_floats():
    """Kernels are compiled for floats: an int would have them compiled once more, in the middle of a trial."""
    for made in (ContactModel(hit=0, touch=2), ContactDynamics(normal_force=1, normal_speed=1)):
        assert all(isinstance(each, float) for name, each in vars(made).items() if name != "constrained")


@pytest.mark.parametrize("constrained", [1, "yes", None, np.nan])
def test_dynamics_are_constrained_or_not(constrained):
    with pytest.raises(ValueError, match="constrained must be True or False"):
        ContactDynamics(constrained=constrained)


@pytest.mark.parametrize("progress", [3, "yes", [1]])
def test_progress_is_a_function(two_finger, progress):
    with pytest.raises(ValueError, match="progress must be a function"):
        warm_up(two_finger, progress)


@pytest.mark.parametrize("made", [3, "slam", HapticSLAM])
def test_what_is_warmed_up_for_is_an_observer(two_finger, made):
    with pytest.raises(ValueError, match="observer must be a HapticSLAM"):
        warm_up(two_finger, observer=made)


@pytest.mark.parametrize("motion", ["kinematic", "raw_angles"])
def test_torques_are_told_where_they_are_known(two_finger, bits, motion):
    """A motion that asks for none believes the same whatever they are."""
    told, untold = (HapticSLAM(two_finger, particles=2, motion=motion, lag=1) for _ in range(2))
    felt, touch = two_finger.rest_pose, np.arange(len(two_finger.patches)) == 3
    assert bits(told.reset(0, felt)) == bits(untold.reset(0, felt))
    for _ in range(3):
        assert bits(told.step(np.full(two_finger.joints, 0.5), felt, touch)) == bits(untold.step(None, felt, touch))


@pytest.mark.parametrize("made", [PoseOnly, HapticSLAM, partial(HapticSLAM, motion="delta_pose")])
def test_a_motion_by_torques_asks_for_them(two_finger, made):
    slam = made(two_finger)
    slam.reset(0)
    with pytest.raises(ValueError, match="torque must be"):
        slam.step(None, two_finger.rest_pose, np.zeros(len(two_finger.patches)))


@pytest.mark.parametrize("resolution", [0.0, -1.0, np.nan, None, 1e9])
def test_evidence_is_of_voxels(resolution):
    with pytest.raises(ValueError, match="resolution must be a finite number"):
        ContactModel().evidence(resolution)


OF_SIGMA = {
    **{motion: lambda hand, sigma, motion=motion: HapticSLAM(hand, sigma, 2, motion=motion) for motion in MOTIONS},
    "floor": DeadReckoning,
    "pose_only": PoseOnly,
}


@pytest.mark.parametrize("make", OF_SIGMA.values(), ids=OF_SIGMA)
def test_an_observer_told_sigma_later_is_as_if_made_with_it(two_finger, make):
    told, made, other = make(two_finger, 3.0), make(two_finger, 0.7), make(two_finger, 3.0)
    told.sigma_deg = 0.7
    assert told.sigma_deg == pytest.approx(0.7)
    rng, felt = np.random.default_rng(0), np.zeros(50, dtype=bool)
    angles = two_finger.rest_pose + rng.normal(0.0, 0.02, (5, two_finger.joints))
    angles[4, 0] = two_finger.joint_limits[0, 1] + np.deg2rad(25.0)  # what 3° of noise may make, and 0.7° may not
    beliefs = []
    for each in (told, made, other):
        each.reset(seed=0, joint_angles=angles[0])
        beliefs.append([each.step(np.zeros(8), q, felt) for q in angles][-1])
    assert beliefs[0] == beliefs[1] != beliefs[2]


@pytest.mark.parametrize("sigma", [-1.0, 91.0, np.nan, "three", None])
def test_a_sigma_that_is_none_is_refused(watching, sigma):
    before = watching.sigma_deg
    with pytest.raises(ValueError, match="sigma_deg must be"):
        watching.sigma_deg = sigma
    assert watching.sigma_deg == before
