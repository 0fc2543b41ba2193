"""How well the wrist of a whole hand is followed, as against by the noise that joints of fingers have."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

import agents
from haptic_env import hand_of
from haptic_lab.analysis.statistics import bootstrapped
from observer import ObserverWrapper
from observer.pose.kalman import MODEL_NOISE
from observer.pose_only import PoseOnly

SIGMA, SECONDS, SHAPES = 3.0, 10.0, ("cube", "sphere", "cylinder", "torus(0.3)", "cone(1.5)", "prism(6)")
FIRST, EACH = 78_660, 12  # nothing was tuned on these seeds
LIES = {"size_jitter": 0.2, "position_jitter": 0.02, "rotation_jitter": 180.0}
BEGUN = 25  # steps

pytestmark = [pytest.mark.statistical, pytest.mark.timeout(1800)]


def _followed(env_id: str, seed: int, wrist: int) -> np.ndarray:
    """(2, 3): by the usual noise, and by the same of all joints: mean square error (deg²) of the wrist and of the
    fingers, and the log density of the angles felt."""
    shape = SHAPES[seed % len(SHAPES)]
    with gym.make(env_id, shape=shape, sigma_deg=SIGMA, episode_seconds=SECONDS, reveal_truth=True, **LIES) as bare:
        hand = hand_of(bare)
        usual, alike = PoseOnly(hand, SIGMA), PoseOnly(hand, SIGMA)
        alike.pose.velocity_noise = MODEL_NOISE
        env = ObserverWrapper(bare, usual)
        policy, state = agents.make("enclosure", env, seed=seed), None
        seen, info = env.reset(seed=seed)
        alike.reset(seed, seen["joint_angles"])
        beliefs, true, over = [(info["belief"], alike.belief)], [info["truth"]["joint_angles"]], False
        while not over:
            action, state = agents.act(policy, seen, state)
            seen, _, _, over, info = env.step(action)
            beliefs.append((info["belief"], alike.step(action, seen["joint_angles"], seen["contacts"])))
            true.append(info["truth"]["joint_angles"])
    result = []
    for which, each in enumerate((usual, alike)):
        off = [
            np.rad2deg(beliefs[step][which].lagged_joint_angles - true[step - each.lag])
            for step in range(BEGUN + each.lag, len(true) - 1)  # with the last one, what was felt is told to its end
        ]
        square = np.square(off).mean(axis=0)
        result.append([square[:wrist].mean(), square[wrist:].mean(), each.pose.log_evidence])
    return np.array(result)


@pytest.mark.parametrize(("env_id", "wrist"), [("HapticSLAM/MyoHand-v0", 3), ("HapticSLAM/AdroitHand-v0", 2)])
def test_a_wrist_is_followed_better_than_by_the_noise_of_fingers(env_id: str, wrist: int) -> None:
    found = np.array([_followed(env_id, seed, wrist) for seed in range(FIRST, FIRST + EACH)])
    for which, name in enumerate(("usual", "the same of all joints")):
        of_wrist, of_fingers = (
            bootstrapped(found[:, which, part], lambda square: np.sqrt(square.mean())) for part in (0, 1)
        )
        print(
            f"{env_id}, {name}: error of the wrist {of_wrist[0]:.3f}° [{of_wrist[1]:.3f}, {of_wrist[2]:.3f}], of the "
            f"fingers {of_fingers[0]:.3f}° [{of_fingers[1]:.3f}, {of_fingers[2]:.3f}]"
        )
    share = bootstrapped(found[:, :, 0], lambda rows: np.sqrt(rows[:, 0].mean() / rows[:, 1].mean()))
    more = bootstrapped(found[:, 0, 2] - found[:, 1, 2], np.mean)
    print(f"{env_id}: {share[0]:.3f} [{share[1]:.3f}, {share[2]:.3f}] of the error of the wrist, what is felt more")
    print(f"  probable by {more[0]:.0f} nats [{more[1]:.0f}, {more[2]:.0f}] in {SECONDS:.0f} s")
    assert share[2] < 1.0
    assert more[1] > 0.0
