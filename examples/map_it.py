"""Make a map and a mesh of what was touched, and say how sure each of them is. The mesh needs the extra meshes."""

import gymnasium as gym

import agents
import haptic_env  # noqa: F401 - registers the environments
from observer import HapticSLAM, ObserverWrapper


def main(path="felt.ply", steps=150):
    """A map (X, Y, Z), and a mesh with the SD of each vertex in `path`."""
    env = gym.make("HapticSLAM/TwoFinger-v0", shape="sphere", sigma_deg=2.0)
    env = ObserverWrapper(env, HapticSLAM(env.unwrapped.hand, sigma_deg=2.0, particles=1))
    policy, state = agents.make("enclosure", env, seed=0), None
    observation, info = env.reset(seed=0)
    for _ in range(steps):
        torque, state = policy.predict(observation, state)
        observation, _, _, _, info = env.step(torque)
    occupancy = env.map_now()  # in hindsight
    print(f"of {occupancy.size} voxels {(occupancy > 0.5).sum()} are solid, {(occupancy < 0.1).sum()} air")
    surface = info["belief"].surface()
    felt = surface.std < 0.002  # m; the rest closes the mesh, and is a guess
    print(f"of {len(surface.vertices)} vertices {felt.sum()} are known to 2 mm: {path}")
    surface.save(path)
    return occupancy, surface


if __name__ == "__main__":
    main()
