"""Explore an object that is hidden, and say what it is."""

import gymnasium as gym

import agents
import haptic_env  # noqa: F401 - registers the environments
from observer import HapticSLAM, ObserverWrapper, ShapePosterior

SIGMA = 3.0  # degrees of noise in every joint


def main(seed=0, seconds=3.0):
    """The probability of each name, through time."""
    env = gym.make("HapticSLAM/TwoFinger-v0", sigma_deg=SIGMA, episode_seconds=seconds)  # one of four, drawn at reset
    hand = env.unwrapped.hand
    namer = ShapePosterior(hand)
    env = ObserverWrapper(env, HapticSLAM(hand, sigma_deg=SIGMA, particles=50), namer)
    policy, state = agents.make("random_torque", env, seed=seed), None
    observation, info = env.reset(seed=seed)
    over, step = False, 0
    while not over:
        torque, state = policy.predict(observation, state)
        observation, _, _, over, info = env.step(torque)
        step += 1
        if step % 25 == 0:
            told = ", ".join(f"{name} {p:.0%}" for name, p in zip(namer.labels, info["posterior"], strict=True))
            print(f"{step / 50:3.1f} s: {told}")
    return dict(zip(namer.labels, info["posterior"], strict=True))


if __name__ == "__main__":
    main()
