"""The environment as a learner takes it: the belief as a flat observation, bits of information as the reward.

`PPO("MlpPolicy", make())` of Stable-Baselines3 learns from it as it is; here random actions stand in for a learner.
"""

import gymnasium as gym

import haptic_env  # noqa: F401 - registers the environments
from agents.hold_action import HoldAction
from observer import BeliefObservation, InformationGainReward, ObserverWrapper, PoseOnly, ShapePosterior


def make(seconds=3.0):
    """An environment that holds each action for 0.1 s, and pays the bits by which the entropy of the name falls."""
    env = gym.make("HapticSLAM/TwoFinger-v0", sigma_deg=3.0, episode_seconds=seconds)
    hand = env.unwrapped.hand
    env = ObserverWrapper(env, PoseOnly(hand, sigma_deg=3.0), ShapePosterior(hand))
    return HoldAction(BeliefObservation(InformationGainReward(env, objective="class")), steps=5)


def main(episodes=2):
    """What random actions earn, bits, an episode each."""
    env, earned = make(), []
    env.action_space.seed(0)
    for seed in range(episodes):
        env.reset(seed=seed)
        total, over = 0.0, False
        while not over:
            _, reward, ended, truncated, _ = env.step(env.action_space.sample())
            total, over = total + float(reward), ended or truncated
        earned.append(total)
    print(f"of 2 bits that there are to know: {', '.join(f'{each:.2f}' for each in earned)}")
    return earned


if __name__ == "__main__":
    main()
