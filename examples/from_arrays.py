"""Name an object from arrays of joint angles and contacts: a hand that was recorded, no simulator, no torques.

The arrays here are of a hand that closes and touches nothing; put your own in their place.
"""

import numpy as np

from haptic_env import hands
from observer import HapticSLAM, ShapePosterior


def main(angles=None, contacts=None, hz=50.0):
    """The probability of each name. Angles (T, J) rad, contacts (T, P) 0 or 1, NaN where nothing was measured."""
    hand = hands.make("two_finger")  # or the TOML of one of your own
    if angles is None:
        angles = hand.rest_pose + np.linspace(0.0, 0.3, 100)[:, None]
        contacts = np.zeros((100, len(hand.patches)))
    slam = HapticSLAM(hand, sigma_deg=2.0, particles=1, motion="kinematic", control_hz=hz)
    namer = ShapePosterior(hand, ["cube", "sphere", "torus(0.4)"])
    slam.reset(seed=0, joint_angles=angles[0])
    for felt, touched in zip(angles, contacts, strict=True):
        namer.update(slam.step(None, felt, touched))
    for belief in slam.flush():  # the steps that waited for what came later
        namer.update(belief)
    told = dict(zip(namer.labels, namer.posterior.round(3).tolist(), strict=True))
    print(told)
    return told


if __name__ == "__main__":
    main()
