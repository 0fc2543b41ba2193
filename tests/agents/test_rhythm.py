"""A rhythm with reflexes: what it is without them, what each finger does about what it feels, and its file."""

from __future__ import annotations

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

import agents
from agents.gains import OF_REFLEXES, gains_of
from agents.rhythm import SHARED, Rhythm, rhythm_for
from agents.sb3 import FOLDER, SHIPPED, WholeHand, read_model
from agents.sweep import SweepingMotion
from haptic_lab.learning import presets
from observer import BeliefFeatures, ObserverWrapper, PoseOnly, ShapePosterior

RNG = np.random.default_rng(0)
DECISION = 0.04  # s


@pytest.fixture(scope="module")
def hand():
    return gym.make("HapticSLAM/TwoFinger-v0").unwrapped.hand


def rhythm(hand, **gains: float) -> Rhythm:
    space = BeliefFeatures(hand, (), 10.0, 50.0, ["contacts"]).space
    told = {"env": "HapticSLAM/TwoFinger-v0", "entries": ["contacts"], "hold": 2}
    return rhythm_for(hand, space, gains_of(gains), DECISION, told)


def play(made: Rhythm, felt: np.ndarray) -> np.ndarray:
    """(T, J): what it commands where it feels (T, P)."""
    memory, torques = (), []
    for step, contacts in enumerate(felt):
        torque, memory = made.predict(contacts.astype(np.float32), memory, step == 0, True, RNG)
        torques.append(torque)
    return np.array(torques)


def touches(hand, *names: str, steps: int = 50, since: int = 0) -> np.ndarray:
    """(T, P): patches that feel contact from a step on."""
    felt = np.zeros((steps, len(hand.patches)), np.int8)
    felt[since:, [hand.patches.names.index(name) for name in names]] = 1
    return felt


def test_without_reflexes_it_is_the_sweep(hand):
    """But for the strokes, which know that links are of different lengths: within an eighth of the limits."""
    commanded = play(rhythm(hand), touches(hand, steps=250))
    sweep = SweepingMotion().torques(DECISION * np.arange(250), hand)
    np.testing.assert_allclose(commanded, np.clip(sweep, -1.0, 1.0), atol=0.12)
    felt = RNG.integers(0, 2, (250, len(hand.patches)))
    np.testing.assert_array_equal(play(rhythm(hand, withdraw=10.0), felt), play(rhythm(hand, withdraw=10.0), 0 * felt))


@pytest.mark.parametrize(
    "gain", [name for name in OF_REFLEXES if name.startswith(("close_", "curl_t", "curl_s", "curl_a"))]
)
def test_a_finger_does_something_about_what_it_feels_itself_unless_a_gain_says_otherwise(hand, gain):
    """`along` needs a touch that is not in the middle, and `back` one there."""
    felt = touches(hand, "thumb_distal_0_dorsal", since=3)
    change = np.abs(play(rhythm(hand, **{gain: -0.3}), felt) - play(rhythm(hand), felt)).max(axis=0)
    mine, other = change[hand.joint_group == 0], change[hand.joint_group == 1]
    if gain == "close_others":
        mine, other = other, mine
    assert mine.max() > 0.05
    assert other.max() == 0.0


def test_fingers_have_the_same_reflexes(hand):
    gains = {"close_touch": 0.3, "curl_along": -0.4, "across_side": 0.5, "sideways": 0.0, "beat_touch": 1.0}
    thumb, index = (
        play(rhythm(hand, **gains), touches(hand, f"{finger}_distal_0_left", since=5)) for finger in ("thumb", "index")
    )
    np.testing.assert_allclose(thumb[:, hand.joint_group == 0], index[:, hand.joint_group == 1], atol=0.1)
    np.testing.assert_allclose(thumb[:, hand.joint_group == 1], index[:, hand.joint_group == 0], atol=0.1)


def test_sides_are_told_apart(hand):
    gains = {"sideways": 0.0, "across_side": 0.5}
    left, right = (
        play(rhythm(hand, **gains), touches(hand, f"thumb_middle_0_{side}"))[:, 0] for side in ("left", "right")
    )
    np.testing.assert_allclose(left, -right, atol=1e-6)
    assert np.abs(left[-1]) == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(("withdraw", "opens"), [(0.06, True), (10.0, False)])
def test_a_finger_that_has_touched_for_long_enough_opens(hand, withdraw, opens):
    """At 0.16 s it still closes ever harder; the beat turns round once it has touched, and no other finger's does."""
    flexor, still = hand.joint_names.index("thumb_mcp_flexion"), hand.joint_names.index("index_mcp_flexion")
    torques = play(rhythm(hand, curl_drift=0.0, withdraw=withdraw), touches(hand, "thumb_distal_tip", steps=6, since=2))
    assert (torques[5, flexor] < torques[4, flexor]) == opens
    assert torques[5, still] > torques[4, still]


def test_touch_quickens_the_beat(hand):
    felt = touches(hand, "thumb_distal_tip", steps=100)
    flexor = hand.joint_names.index("thumb_mcp_flexion")
    turns = [
        np.count_nonzero(np.diff(np.sign(np.diff(play(rhythm(hand, curl_drift=0.0, **gains), felt)[:, flexor]))))
        for gains in ({"withdraw": 10.0}, {"withdraw": 10.0, "beat_touch": 1.0})
    ]
    assert turns[1] > 1.6 * turns[0]


def test_a_file_gives_the_same_rhythm(hand, tmp_path):
    made = rhythm(hand, curl_touch=0.5, beat_slow=1.0)
    made.write(tmp_path / "model.npz")
    again, felt = read_model(tmp_path / "model.npz"), RNG.integers(0, 2, (50, len(hand.patches)))
    assert isinstance(again, Rhythm)
    np.testing.assert_array_equal(play(made, felt), play(again, felt))
    assert again.told == made.told
    assert again.gains == made.gains


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"gains": {"speed": 1.0}}, "unknown gain 'speed'; choose from"),
        ({"gains": {"beat": 100.0}}, "gain beat must be"),
        ({"gains": {"beat": float("nan")}}, "gain beat must be"),
        ({"seconds": 0.0}, "seconds must be"),
        ({"strokes": np.zeros((3, 2, 7))}, "'strokes' must be finite numbers of shape"),
        ({"felt": np.zeros((3, 2, 50))}, "'felt' must be finite numbers of shape"),
        ({"shared": np.zeros((5, 7))}, "'shared' must be finite numbers of shape"),
    ],
)
def test_a_file_that_is_no_rhythm_is_refused(hand, tmp_path, change, message):
    replace(rhythm(hand), **change).write(tmp_path / "model.npz")
    with pytest.raises(ValueError, match=f"is no policy that `agents.export` has written: {message}"):
        read_model(tmp_path / "model.npz")


def test_a_numb_one_acts_as_if_it_touched_nothing(tmp_path, hand):
    made = rhythm(hand, curl_touch=0.7, withdraw=0.1)
    made.write(tmp_path / "model.npz")
    env = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", episode_seconds=1.0)
    env = ObserverWrapper(env, PoseOnly(hand), ShapePosterior(hand))
    agents.ablate(env, tmp_path / "model.npz", tmp_path / "numb.npz", ["contacts"])
    expected = play(made, touches(hand, steps=25))
    for name, same in (("numb.npz", True), ("model.npz", False)):
        policy, state = agents.make(tmp_path / name, env, seed=0), None
        observation, _ = env.reset(seed=0)
        commanded = []
        for _ in range(50):
            torque, state = policy.predict(observation, state)
            observation, *_ = env.step(torque)
            commanded.append(torque)
        assert np.array_equal(commanded[::2], expected) == same
        np.testing.assert_array_equal(commanded[::2], commanded[1::2])


def test_what_ships_needs_no_observer_and_acts_for_several_environments():
    env = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", episode_seconds=1.0)
    hand = env.unwrapped.hand
    alone = agents.make("reflexes", env, seed=0)
    guided = agents.make("reflexes", ObserverWrapper(env, PoseOnly(hand)), seed=1)
    states = [None, None]
    stacked = None
    observation, _ = env.reset(seed=0)
    for _ in range(50):
        first, states[0] = alone.predict(observation, states[0])
        second, states[1] = guided.predict(observation, states[1])
        both = {name: np.stack([each, each]) for name, each in observation.items()}
        several, stacked = alone.predict(both, stacked)
        np.testing.assert_array_equal(first, second)
        np.testing.assert_array_equal([first, first], several)
        observation, *_ = env.step(first)
    assert observation["contacts"].any()


@pytest.mark.parametrize("control_hz", [25.0, 50.0, 100.0])
def test_what_ships_keeps_its_pace_at_any_rate(control_hz):
    env = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", control_hz=control_hz, episode_seconds=3.0)
    policy = agents.make("reflexes", env, seed=0)
    observation, _ = env.reset(seed=0)
    still = {name: np.zeros_like(each) for name, each in observation.items()}
    state = None
    for _ in range(int(2.0 * control_hz)):
        _, state = policy.predict(still, state)
    drift = state[2][2]
    assert drift == pytest.approx(2.0 * np.pi * read_model(FOLDER / "reflexes.npz").gains["drift"] * 2.0, rel=0.05)


def test_a_file_that_reads_contacts_alone_acts_for_several_environments():
    env = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", episode_seconds=1.0)
    observation, _ = env.reset(seed=0)
    both = {name: np.stack([each, each]) for name, each in observation.items()}
    actions, _ = agents.make(FOLDER / "reflexes.npz", env, seed=0).predict(both)
    first, _ = agents.make("reflexes", env, seed=0).predict(observation)
    np.testing.assert_array_equal(actions, [first, first])


def test_what_ships_is_small_and_of_its_preset():
    preset = presets.read("reflexes")
    made = read_model(SHIPPED.parent / "reflexes.npz")
    assert isinstance(made, Rhythm)
    assert (SHIPPED.parent / "reflexes.npz").stat().st_size < 20_000
    assert made.told == {"env": preset.world.env, "entries": list(preset.world.observation), "hold": preset.world.hold}
    assert made.gains == gains_of(made.gains)
    assert made.gains != preset.rhythm, "something was learnt"


WRIST = {"always": 0.1, "beat": 0.2, "turn": -0.3, "drift": 0.4, "touch": 0.25}


def test_a_wrist_follows_clocks_of_its_own_and_touch(tmp_path):
    """Which no touch quickens; fingers are what they are without it."""
    hand = gym.make("HapticSLAM/MyoHand-v0").unwrapped.hand
    shared = np.zeros((len(SHARED), hand.joints))
    shared[:, 0] = [WRIST[what] for what in SHARED]
    still = rhythm(hand, beat_touch=2.0, curl_touch=0.5)
    made = replace(still, shared=shared)
    made.write(tmp_path / "model.npz")
    felt = touches(hand, "thumb_distal_tip", "index_distal_tip", steps=100, since=20)
    torques = play(read_model(tmp_path / "model.npz"), felt)
    np.testing.assert_array_equal(torques[:, 1:], play(still, felt)[:, 1:])
    seconds = DECISION * np.arange(100)
    waves = np.sin(2 * np.pi * seconds), np.cos(np.pi * seconds), np.sin(2 * np.pi * 0.17 * seconds)
    clocks = WRIST["always"] + sum(WRIST[what] * wave for what, wave in zip(SHARED[1:4], waves, strict=True))
    fast = np.concatenate([np.zeros(20), 1.0 - np.exp(-DECISION / 0.2 * np.arange(1, 81))])
    np.testing.assert_allclose(torques[:, 0], np.clip(clocks + WRIST["touch"] * fast * 2 / 5, -1.0, 1.0), atol=1e-5)


def test_the_whole_hand_that_ships_is_of_its_preset_and_drives_any_hand():
    preset, made = presets.read("whole_hand"), read_model(WholeHand.shipped)
    assert isinstance(made, Rhythm)
    assert WholeHand.shipped.stat().st_size < 40_000
    assert made.told == {"env": preset.world.env, "entries": list(preset.world.observation), "hold": preset.world.hold}
    assert made.gains != preset.rhythm, "something was learnt"
    assert np.flatnonzero(made.shared.any(axis=0)).tolist() == [0, 1, 2], "its wrist"
    for env_id in ("HapticSLAM/MyoHand-v0", "HapticSLAM/TwoFingerArm-v0"):
        env = gym.make(env_id, shape="cube", episode_seconds=1.0)
        hand = env.unwrapped.hand
        observation, _ = env.reset(seed=0)
        torque, _ = agents.make("whole_hand", env).predict(observation)
        expected = made if env_id == preset.world.env else rhythm(hand, **made.gains)
        felt = observation["contacts"][None]
        np.testing.assert_array_equal(torque, play(expected, felt)[0])
