"""What `HapticSLAM` and every bracket promise: the belief, determinism, blindness, the lag, and errors."""

from __future__ import annotations

import ast
import copy
import dataclasses
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import agents
import observer
from haptic_lab.benchmarks import reference
from observer import OBSERVERS, ContactModel, DeadReckoning, HapticSLAM, metrics
from observer.variants import make_observer
from tests.observer.hands import many_patches, pointer, random_tree

STEPS = 40
PARTICLES = 16


def _make(name: str, hand, **keywords):
    return make_observer(name, hand, 3.0, PARTICLES, **keywords)


@pytest.fixture
def trial(explore):
    """Two fingers about a cube, which they touch."""
    made = explore("cube", STEPS, seed=3)
    assert made.contacts.any()
    return made


@pytest.mark.parametrize("name", OBSERVERS)
def test_the_belief_is_as_promised(trial, name):
    slam = _make(name, trial.hand)
    joints, patches = trial.hand.joints, len(trial.hand.patches)
    for belief in trial.beliefs(slam):
        for each in ("joint_angles", "joint_std", "lagged_joint_angles", "lagged_joint_std"):
            value = getattr(belief, each)
            assert value.shape == (joints,)
            assert value.dtype == np.float64
            assert np.isfinite(value).all()
        assert (belief.joint_std >= 0).all()
        assert (belief.lagged_joint_std >= 0).all()
        assert belief.lagged_covariance.shape == (joints, joints)
        assert belief.lagged_contacts is None or belief.lagged_contacts.shape == (patches,)
        count = slam.n_particles
        assert belief.weights.shape == (count,)
        assert belief.weights.sum() == pytest.approx(1)
        assert (belief.weights >= 0).all()
        assert belief.particles.shape == (count, joints)
        assert 1 - 1e-9 <= belief.n_eff <= count + 1e-9
        assert belief.occupancy.shape == belief.grid.shape == slam.grid.shape
        assert belief.occupancy.dtype == np.float64
        assert belief.occupancy.min() >= 0
        assert belief.occupancy.max() <= 1
        assert np.isfinite(belief.log_evidence)
        assert 0 <= belief.moved_share <= 1
        assert isinstance(belief.resampled, bool)
        assert 0 <= belief.lag_steps <= slam.lag


@pytest.mark.parametrize("name", OBSERVERS)
def test_a_map_says_something_where_the_hand_was_and_nothing_elsewhere(trial, name):
    slam = _make(name, trial.hand)
    beliefs = trial.beliefs(slam)
    assert (beliefs[0].occupancy == 0.5).all()
    last = beliefs[-1].occupancy
    assert (last < 0.5 * slam.contact_model.prior).any(), "what was swept is freer than what was merely near"
    # At the raw angles so little is sure that no touch need have a single suspect in so short a trial.
    assert name == "floor" or (last > 0.5).any()
    assert (last == 0.5).mean() > 0.3


@pytest.mark.parametrize("name", OBSERVERS)
def test_the_same_seed_is_the_same_bits(trial, bits, name):
    slam, other = _make(name, trial.hand), _make(name, trial.hand)
    first = [bits(belief) for belief in trial.beliefs(slam, seed=1)]
    assert [bits(belief) for belief in trial.beliefs(other, seed=1)] == first
    assert [bits(belief) for belief in trial.beliefs(slam, seed=1)] == first, "a reset restores everything"
    if slam.n_particles > 1:
        assert [bits(belief) for belief in trial.beliefs(slam, seed=2)] != first


def test_any_number_of_threads_gives_the_same_bits(trial, bits):
    runs = [
        [bits(belief) for belief in trial.beliefs(_make("haptic_slam", trial.hand, threads=number))]
        for number in (1, 2, 5, None)
    ]
    assert all(run == runs[0] for run in runs)


@pytest.mark.parametrize(
    ("name", "lag"),
    [(name, lag) for name in OBSERVERS for lag in (0, 1, 4, None) if lag is None or name not in ("floor", "ceiling")],
)
def test_the_contacts_of_a_step_meet_its_pose(trial, name, lag):
    """`lagged_contacts` are those that were felt `lag_steps` ago, and every step enters the map once."""
    slam = _make(name, trial.hand, **({} if lag is None else {"lag": lag}))
    felt = [np.zeros(len(trial.hand.patches)), *trial.contacts]
    beliefs = trial.beliefs(slam)
    entered = []
    for now, belief in enumerate(beliefs):
        step = min(now, STEPS) - belief.lag_steps
        if belief.lagged_contacts is not None:
            np.testing.assert_array_equal(belief.lagged_contacts, felt[step])
            entered.append(step)
    assert entered in (list(range(STEPS + 1)), list(range(1, STEPS + 1)))


def test_without_noise_the_lagged_pose_is_the_one_that_was_felt(trial):
    slam = HapticSLAM(trial.hand, 1e-3, particles=4, lag=3)
    for now, belief in enumerate(trial.beliefs(slam, truth=True)):
        step = min(now, STEPS) - belief.lag_steps
        if step > 1:
            np.testing.assert_allclose(belief.lagged_joint_angles, trial.true[step - 1], atol=1e-3)


def test_kept_beliefs_never_change(trial, bits):
    slam = _make("haptic_slam", trial.hand, lag=2)
    kept, at_the_time = [], []
    beliefs = [slam.reset(seed=0)]
    for each in zip(trial.torque, trial.felt, trial.contacts, strict=True):
        kept += beliefs
        at_the_time += [bits(copy.deepcopy(belief).copy()) for belief in beliefs]
        beliefs = [slam.step(*each)]
    for belief in slam.flush():
        kept.append(belief)
    slam.reset(seed=1)
    assert [bits(belief) for belief in kept[: len(at_the_time)]] == at_the_time


def test_lazy_occupancies_are_those_of_their_time(trial):
    """Asked for late or at once, held or not."""
    late = [belief.occupancy for belief in trial.beliefs(_make("haptic_slam", trial.hand))]
    slam = _make("haptic_slam", trial.hand)
    at_once = [slam.reset(seed=0).occupancy]
    for each in zip(trial.torque, trial.felt, trial.contacts, strict=True):
        at_once.append(slam.step(*each).occupancy)
    at_once += [belief.occupancy for belief in slam.flush()][-1:]
    for first, second in zip(late[: STEPS + 1] + late[-1:], at_once, strict=True):
        np.testing.assert_array_equal(first, second)


def test_a_copy_owns_its_arrays(trial):
    belief = trial.beliefs(_make("haptic_slam", trial.hand))[-1]
    own = belief.copy()
    for name in belief.__dataclass_fields__:
        if isinstance(getattr(belief, name), np.ndarray):
            assert not np.shares_memory(getattr(own, name), getattr(belief, name))
            np.testing.assert_array_equal(getattr(own, name), getattr(belief, name))
    np.testing.assert_array_equal(own.occupancy, belief.occupancy)
    own.joint_angles[:] = np.nan
    assert np.isfinite(belief.joint_angles).all()


def test_a_belief_does_not_change_with_what_was_handed_in(trial, bits):
    slam = _make("haptic_slam", trial.hand)
    slam.reset(seed=0)
    torque, felt, contacts = trial.torque[0].copy(), trial.felt[0].copy(), trial.contacts[0].copy()
    belief = slam.step(torque, felt, contacts)
    before = bits(belief)
    torque[:], felt[:], contacts[:] = 0.7, 0.7, 1
    assert bits(belief) == before
    with pytest.raises(ValueError, match="read-only"):
        belief.occupancy[0, 0, 0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        belief.n_eff = 3.0


def test_boolean_contacts_are_copied_in(trial, bits):
    results = []
    for spoil in (False, True):
        slam = _make("haptic_slam", trial.hand, lag=5)
        slam.reset(seed=0)
        for each in zip(trial.torque, trial.felt, trial.contacts.astype(bool), strict=True):
            torque, felt, contacts = (array.copy() for array in each)
            belief = slam.step(torque, felt, contacts)
            if spoil:
                contacts[:] = True
        results.append(bits(belief))
    assert results[0] == results[1]


def _beliefs_in(env: gym.Env, spoil) -> list:
    """Of an observer in an environment whose truth `spoil` corrupts before every step."""
    observation, _ = env.reset(seed=4)
    slam = _make("haptic_slam", env.unwrapped.hand)
    slam.reset(seed=0)
    policy, state, beliefs = agents.make("random_torque", env, seed=4), None, []
    for _ in range(STEPS):
        action, state = policy.predict(observation, state)
        observation, *_, info = env.step(action)
        spoil(env, info)
        beliefs.append(slam.step(action, observation["joint_angles"], observation["contacts"]))
    return beliefs + slam.flush()


def test_corrupting_the_truth_changes_no_belief(bits):
    def replace(env, info):
        solid = env.unwrapped.solid
        env.unwrapped.solid = dataclasses.replace(solid, name="sphere", position=(1.0, 2.0, 3.0), size=(0.1, 0.1, 0.1))
        info["truth"]["joint_angles"][:] = 9.0
        info["truth"]["shape"] = "pyramid"

    runs = []
    for reveal, spoil in ((True, lambda env, info: None), (True, replace), (False, lambda env, info: None)):
        env = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", reveal_truth=reveal)
        runs.append([bits(belief) for belief in _beliefs_in(env, spoil)])
        env.close()
    assert runs[0] == runs[1] == runs[2]


# Of haptic_env; nothing that runs.
ALLOWED = (
    "arrays",
    "cache",
    "compiled",
    "coupling",
    "extras",
    "files",
    "grid",
    "hand",
    "hand_env",
    "hand_of",
    "kernel_cache",
    "moved",
    "notice",
    "patches",
    "pose",
    "readable",
    "reading",
    "recordings",
    "rotation",
    "sensors",
    "shapes",
    "validate",
)


@pytest.mark.parametrize("package", ["observer", "agents"])
def test_nothing_that_runs_a_simulation_is_imported(package):
    root = Path(observer.__file__).parents[1] / package
    files = sorted(root.rglob("*.py"))
    assert files
    for file in files:
        assert not _forbidden(file.read_text(), package), file


@pytest.mark.parametrize(
    "source",
    [
        "import haptic_env",
        "from haptic_env import scene",
        "from haptic_env.explore import ExploreEnv",
        "def f():\n    import haptic_env.hands.two_finger",
        "import scripts.trial",
        "from haptic_lab.trial import Trial",
    ],
)
def test_the_check_of_imports_would_find_one(source):
    assert _forbidden(source, "observer")
    assert _forbidden("import mujoco", "agents")
    assert not _forbidden("from haptic_env.grid import Grid\nfrom haptic_env import validate", "observer")


BY_NAME = "haptic_env.hands"  # of a saved observer the hand is found by its name; what makes hands is not imported


def _forbidden(source: str, package: str) -> list[str]:
    """What `source`, a file of `package`, imports and may not."""
    names = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    found = []
    for name in names:
        top, inner, *_ = *name.split("."), ""
        outside = top == "haptic_env" and inner not in ALLOWED and name != BY_NAME
        if top in ("scripts", "haptic_lab") or outside or (package == "agents" and top == "mujoco"):
            found.append(name)
    return found


@pytest.mark.parametrize("make", [many_patches, pointer, lambda: random_tree(0)], ids=["many", "pointer", "tree"])
def test_any_hand_will_do(make):
    hand, rng = make(), np.random.default_rng(0)
    slam = HapticSLAM(hand, 3.0, particles=4, lag=2)
    slam.reset(seed=0)
    for _ in range(10):
        q = hand.rest_pose + 0.05 * rng.standard_normal(hand.joints)
        belief = slam.step(rng.uniform(-1, 1, hand.joints), q, rng.random(len(hand.patches)) < 0.1)
    assert np.isfinite(belief.joint_angles).all()
    slam.flush()


def test_nearly_exact_angles_work(trial):
    for belief in trial.beliefs(HapticSLAM(trial.hand, 1e-3, particles=4), truth=True):
        assert np.isfinite(belief.joint_angles).all()
        assert np.isfinite(belief.log_evidence)


def test_nothing_but_reset_and_step_is_possible_in_their_order(trial):
    slam = _make("haptic_slam", trial.hand)
    step = trial.torque[0], trial.felt[0], trial.contacts[0]
    for call in (lambda: slam.step(*step), slam.flush):
        with pytest.raises(ValueError, match=r"call reset\(\) before"):
            call()
    slam.reset(seed=0)
    slam.step(*step)
    slam.flush()
    for call in (lambda: slam.step(*step), slam.flush):
        with pytest.raises(ValueError, match=r"call reset\(\) before"):
            call()
    slam.reset(seed=0)
    slam.step(*step)


def test_a_refused_step_leaves_no_trace(trial, bits):
    clean, bothered = _make("haptic_slam", trial.hand), _make("haptic_slam", trial.hand)
    clean.reset(seed=0)
    bothered.reset(seed=0)
    for torque, felt, contacts in zip(trial.torque, trial.felt, trial.contacts, strict=True):
        for bad in ((torque * np.nan, felt, contacts), (torque, felt[:3], contacts), (torque, felt, contacts + 2)):
            with pytest.raises(ValueError, match="must be"):
                bothered.step(*bad)
        assert bits(clean.step(torque, felt, contacts)) == bits(bothered.step(torque, felt, contacts))


BAD_STEPS = {
    "NaN torque": (lambda u, q, z: (u * np.nan, q, z), r"torque must be finite numbers of shape \(8,\), got .*nan"),
    "torque of the wrong shape": (lambda u, q, z: (u[:7], q, z), r"torque must be .*got shape \(7,\)"),
    "infinite angle": (lambda u, q, z: (u, q + np.inf, z), "joint_angles must be .*radians.*inf"),
    "angles of the wrong shape": (lambda u, q, z: (u, q[None], z), r"joint_angles must be .*got shape \(1, 8\)"),
    "words": (lambda u, q, z: (u, ["a"] * 8, z), "joint_angles must be .*got"),
    "contact of 2": (
        lambda u, q, z: (u, q, 2 * np.ones(50, dtype=int)),
        "contacts must be 0 or 1, got .*2.* at index 0",
    ),
    "contact of a half": (lambda u, q, z: (u, q, np.full(50, 0.5)), "contacts must be 0 or 1, got .*0.5"),
    "contact without end": (lambda u, q, z: (u, q, np.full(50, np.inf)), "contacts must be 0 or 1, got .*inf"),
    "contacts of the wrong shape": (lambda u, q, z: (u, q, z[:49]), r"contacts must be .*\(50,\), got shape \(49,\)"),
}


@pytest.mark.parametrize("case", BAD_STEPS)
def test_impossible_observations_are_refused(trial, case):
    spoil, message = BAD_STEPS[case]
    slam = _make("haptic_slam", trial.hand)
    slam.reset(seed=0)
    with pytest.raises(ValueError, match=message):
        slam.step(*spoil(trial.torque[0], trial.felt[0], trial.contacts[0]))


BAD_KEYWORDS = [
    *[("sigma_deg", value) for value in (-1.0, np.nan, np.inf, 91.0, "3", True)],
    *[
        (name, value)
        for name in ("bias_deg", "drift_deg", "start_std_deg")
        for value in (-1.0, np.nan, np.inf, 91.0, "3", None, True)
    ],
    *[("drift_seconds", value) for value in (0.0, -1.0, np.nan, np.inf, "3", None, True)],
    *[("proportional", value) for value in (-0.1, 1.1, np.nan, None, True)],
    *[(name, value) for name in ("particles", "candidates") for value in (0, -1, 1.5, np.nan, "8", None, True)],
    *[("lag", value) for value in (-1, 1.5, np.nan, "1", True)],
    *[("matching", value) for value in ("median", 3, None)],
    *[("motion", value) for value in ("linear", None)],
    *[("motor_noise", value) for value in (-0.1, 1.1, np.nan, None)],
    *[("control_hz", value) for value in (0.0, -50.0, np.nan, 1000.0)],
]


@pytest.mark.parametrize(("name", "value"), BAD_KEYWORDS)
def test_impossible_settings_are_refused(two_finger, name, value):
    with pytest.raises(ValueError, match=rf"({name} must be .* got|unknown {name}) {value!r}"):
        HapticSLAM(two_finger, **{name: value})


@pytest.mark.parametrize("name", [field.name for field in dataclasses.fields(ContactModel)])
@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf, 1e7, "1", None])
def test_impossible_contact_models_are_refused(name, value):
    with pytest.raises(ValueError, match=f"{name} must be a finite number in .* got"):
        ContactModel(**{name: value})


@pytest.mark.parametrize(
    ("name", "value", "range"),
    [
        ("hit", 1.0, "be below 1"),
        *[(name, value, "lie strictly between 0 and 1") for name in ("prior", "false_alarm") for value in (0.0, 1.0)],
        *[(name, 0.0, "be above 0 voxels") for name in ("fall", "edge")],
    ],
)
def test_certain_contacts_are_refused(name, value, range):
    with pytest.raises(ValueError, match=f"{name} must {range}, got {value}"):
        ContactModel(**{name: value})


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_weights_that_are_not_finite_are_an_error(two_finger, value):
    slam = HapticSLAM(two_finger, 3.0, particles=4)
    slam.reset(seed=0)
    with np.errstate(invalid="ignore"), pytest.raises(FloatingPointError, match="weights are not finite"):
        slam._state.weigh(np.full(4, value))


def test_free_space_is_where_the_finger_was_at_a_known_pose(two_finger):
    """At a known pose, where no SD but the voxels' own counts: free inside, the prior about it, unknown elsewhere."""
    model = ContactModel()
    slam = DeadReckoning(two_finger, 0.0, contact_model=model)
    slam.reset(seed=0)
    for _ in range(30):
        belief = slam.step(np.zeros(8), two_finger.rest_pose, np.zeros(50, dtype=int))
    height = reference.height(two_finger, slam.grid, two_finger.rest_pose) / slam.grid.resolution
    assert belief.occupancy[height < -0.5].max() < 0.5 * model.prior
    assert (height < -0.5).sum() > 100
    told = metrics.neighbourhood(height < model.near)
    np.testing.assert_allclose(belief.occupancy[told & (height > 2 * model.edge)], model.prior)
    np.testing.assert_array_equal(belief.occupancy[~told], 0.5)


@pytest.mark.parametrize("lag", [0, 3])
def test_particles_that_maps_do_not_move_stay_with_the_filter(explore, lag):
    """What is felt later tells of the last pose too; particles that were drawn about it have to follow."""
    trial = explore("cube", 60, sigma_deg=5.0)
    slam = HapticSLAM(trial.hand, 5.0, particles=3, candidates=1, lag=lag)
    last = trial.beliefs(slam)[-1]
    now = slam.pose.mean[slam.pose.lagged(0)]
    np.testing.assert_allclose(last.particles, np.tile(now, (3, 1)), atol=1e-9)
