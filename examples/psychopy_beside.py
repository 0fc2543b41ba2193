"""An experiment in PsychoPy with the observer beside it, by calls: what people felt it feels too, frame by frame.

Yours is `glove.feel()`, which returns joint angles (J,) rad and contacts (P,) 0 or 1 of the hand now. The table that is
written is one for `haptic-slam people`. (Over LSL the observer is a process of
its own, `haptic-slam live`, and the experiment reads its beliefs from a stream.)
"""

from __future__ import annotations

import csv

from haptic_env import hands
from observer import HapticSLAM, ShapePosterior

HAND, NAMES, HZ = hands.make("two_finger"), ("cube", "sphere"), 50.0  # a window of 60 Hz: 60.0


def explore(feel, flip, seconds):
    """One exploration: a frame of the window after the other; what the observer believes of each name in the end."""
    slam = HapticSLAM(HAND, sigma_deg=3.0, particles=1, motion="kinematic", control_hz=HZ)  # no torques are known
    namer = ShapePosterior(HAND, NAMES)
    slam.reset(seed=0, joint_angles=feel()[0])
    for _ in range(round(seconds * HZ)):
        namer.update(slam.step(None, *feel()))
        flip()
    for belief in slam.flush():
        namer.update(belief)
    return dict(zip(namer.labels, namer.posterior, strict=True))


def experiment(subject, objects, feel, flip, ask, path, seconds=10.0):
    """A trial for each object: explored, asked for by `ask()`, and written, with what the observer believed of it."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(["subject", "object", "response", "seconds", *(f"observer_{name}" for name in NAMES)])
        for shown in objects:
            believed = explore(feel, flip, seconds)
            table.writerow([subject, shown, ask(), seconds, *(round(believed[name], 4) for name in NAMES)])


if __name__ == "__main__":
    from glove import feel
    from psychopy import event, visual

    window = visual.Window()
    visual.TextStim(window, "Feel it. Then: c for a cube, s for a sphere.").autoDraw = True
    keys = {"c": "cube", "s": "sphere"}
    ask = lambda: keys[event.waitKeys(keyList=[*keys])[0]]  # noqa: E731
    experiment("S1", ["cube", "sphere"] * 10, feel, window.flip, ask, "S1.csv")
