"""A policy of one's own beside random torques: how soon is one name above 95 %, and is it right?"""

import gymnasium as gym
import numpy as np

import agents
import haptic_env  # noqa: F401 - registers the environments
from agents import Policy
from observer import ObserverWrapper, PoseOnly, ShapePosterior
from observer.metrics import time_to_decision


class Squeeze(Policy):
    """Closes and opens once a second."""

    def decide(self, observation, state, deterministic):
        (step,) = state or (0,)
        return np.full(self.joints, 0.6 * np.sin(2 * np.pi * step / 50), np.float32), (step + 1,)


def main(trials=1, seconds=3.0):
    """The median time to a decision of each policy, s, and how many of the names were right."""
    env = gym.make("HapticSLAM/TwoFinger-v0", sigma_deg=3.0, episode_seconds=seconds)
    namer = ShapePosterior(env.unwrapped.hand)
    env = ObserverWrapper(env, PoseOnly(env.unwrapped.hand, sigma_deg=3.0), namer)
    found = {}
    for policy in (Squeeze(env, seed=0), agents.make("random_torque", env, seed=0)):
        times, right = [], 0
        for seed, shape in ((seed, shape) for seed in range(trials) for shape in namer.labels):
            (observation, _), state, over, course = env.reset(seed=seed, options={"shape": shape}), None, False, []
            while not over:
                torque, state = policy.predict(observation, state)
                observation, _, _, over, info = env.step(torque)
                course.append(info["posterior"])
            times.append(time_to_decision(np.arange(1, len(course) + 1) / 50, course))
            right += namer.labels[np.argmax(course[-1])] == shape
        found[policy.name] = float(np.median(np.nan_to_num(times, nan=np.inf))), right
        print(f"{policy.name:15} {found[policy.name][0]:.2f} s, {right} of {len(times)} right")
    return found


if __name__ == "__main__":
    main()
