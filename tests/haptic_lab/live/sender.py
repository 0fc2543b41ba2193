"""A process that sends a moving hand by the Lab Streaming Layer: NAME of the streams, hand, Hz, seconds.

Stamps are steady, as a device's are; samples are pushed when their stamp is due.
"""

from __future__ import annotations

import sys
import time

from mne_lsl import lsl

from haptic_env import hands
from tests.haptic_lab.live.streams import moving

TOUCHES = 4.0  # a second, of ten samples each


def main(name: str, which: str, rate: float, seconds: float) -> None:
    lsl.set_config_content("[log]\nlevel = -3\n")
    hand = hands.make(which)
    count = int(seconds * rate)
    _, angles, contacts = moving(hand, count, rate, touches=int(TOUCHES * seconds))
    outlets = []
    for kind, labels in (("joints", hand.joint_names), ("touch", hand.patches.names)):
        info = lsl.StreamInfo(f"{name}_{kind}", kind, len(labels), rate, "float64", f"{name}_{kind}")
        info.set_channel_names(list(labels))
        outlets.append(lsl.StreamOutlet(info))
    print("ready", flush=True)
    while not all(each.has_consumers for each in outlets):
        time.sleep(0.01)
    start = lsl.local_clock()
    for k in range(count):
        stamp = start + k / rate
        time.sleep(max(0.0, stamp - lsl.local_clock()))
        for outlet, values in zip(outlets, (angles, contacts), strict=True):
            outlet.push_sample(values[k], timestamp=stamp)
    time.sleep(1.0)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], float(sys.argv[3]), float(sys.argv[4]))
