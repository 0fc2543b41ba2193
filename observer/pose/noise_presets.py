"""Noises of felt angles to believe in, by name: keywords of `HapticSLAM`, `PoseOnly` and the environment.

**human**: a person who feels the joints of a hand that is not seen. `NOISES` has the figures of finger joints, `of`
those of each joint of a hand.

- *Finger joints*: the mean error at the index finger's metacarpophalangeal joint is 5.72° in 12 persons, within one of
  whom it varies by about 1° from day to day (Wycherley, Helliwell & Bird 2005, Rheumatology 44(5), 638-641): an RMS of
  5.72·√(π/2) = 7.17°, *assumed* normal. *Assumed* that what varies from trial to trial, the drift, is the same share of
  it as at the wrist, 4.59/6.83: 4.8°; the rest, what a person is always wrong by, is the bias: 5.3°. All finger joints
  are *assumed* to be alike. Displacements too slow to be felt as movements were detected equally well at the three
  joints of the middle finger ("Ability to detect angular displacements of the fingers made at an imperceptibly slow
  speed", 1990); but the index finger's proximal interphalangeal joint had no sense of position apart from that of
  movement, while its metacarpophalangeal joint had one (Brain 1986, 109, 1195-1208). Nobody's figures are known to us
  that give degrees for the two joints beyond the knuckle, for the thumb, or for abduction.
- *Flexion of the wrist*: passive matching of its angle to a gauge, 32 persons: total error 6.83° (RMS), of which 4.59°
  vary from trial to trial (Rinderknecht, Popp, Lambercy & Gassert 2016, Front. Hum. Neurosci. 10, 316): the drift; the
  bias is √(6.83² - 4.59²) = 5.1°.
- *Abduction of the wrist*: the least difference that is felt is 1.52°, of flexion 2.15° (Cappello, Elangovan, Contu,
  Khosravani, Konczak & Masia 2015, Front. Hum. Neurosci. 9, 198), and abduction is matched best of the wrist's three
  degrees of freedom (Marini, Squeri, Morasso, Konczak & Masia 2016, PLoS ONE, 10.1371/journal.pone.0161155). *Assumed*
  that errors are smaller by the same factor.
- *Rotation of the forearm*: *assumed* to be as flexion, as the latter study has it. So are the joints of a wrist that
  moves as a whole (`haptic_env.hands.wrist`), *assumed* for want of any figures: 5.1° of those that slide are 9 mm.
- `sigma_deg`: shoulder and elbow are known to 0.6 to 1.1° (van Beers, Sittig & Denier van der Gon 1998, Exp. Brain Res.
  122(4), 367-377). *Assumed*: that all joints are alike, and that this much is new at every step.
- `drift_seconds`: *assumed*, about as long as from one trial of such an experiment to the next. Measurements do not
  agree: unseen hands drift by 8 cm in 70 movements (Brown, Rosenbaum & Sainburg 2003, J. Neurophysiol. 90(5),
  3105-3118), or do not within 10 to 20 s (Desmurget, Vindras, Gréa, Viviani & Grafton 2000, Exp. Brain Res. 134(3),
  363-377).

**uncalibrated_glove**: a CyberGlove III whose calibration is that of other people; the same for all joints.

- `bias_deg`: with the best calibration for each person most joints have an RMS error below 10°, with one across persons
  5 to 10° more (Heinrich et al. 2024, IEEE Sensors J. 24(9), doi 10.1109/JSEN.2024.3376606): 10 + 5. *Assumed*: that
  all of it is an offset; wrong gains are not modelled.
- `sigma_deg`: *assumed*, one step of a reading, which has 8 bits and is of the order of a degree (Fuchs, Moreau &
  Guitton 2011, Virtual Reality: Concepts and Technologies, chapter 7).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from haptic_env import validate
from haptic_env.hand import Hand

NOISES: dict[str, dict[str, float]] = {
    "human": {"sigma_deg": 1.1, "bias_deg": 5.3, "drift_deg": 4.8, "drift_seconds": 10.0},
    "uncalibrated_glove": {"sigma_deg": 1.0, "bias_deg": 15.0},
}
FLEXION = {"bias_deg": 5.1, "drift_deg": 4.6}  # of the wrist
ABDUCTION = {name: round(1.52 / 2.15 * degrees, 1) for name, degrees in FLEXION.items()}
WRIST = {  # joints of MyoHand and of Adroit
    **dict.fromkeys(("pro_sup", "flexion", "WRJ0"), FLEXION),
    **dict.fromkeys(("deviation", "WRJ1"), ABDUCTION),
}
OF_JOINTS: dict[str, Mapping[str, Mapping[str, float]]] = {"human": WRIST}  # which have figures of their own
OF_WHOLE: dict[str, Mapping[str, float]] = {"human": FLEXION}  # of joints that move the hand as a whole


def of(name: str, hand: Hand) -> dict[str, Any]:
    """Give a noise as it is of each joint of a hand.

    Args:
        name: one of `NOISES`.
        hand: with J joints.

    Returns:
        Keywords: numbers, and (J,) degrees where joints differ.

    Raises:
        ValueError: for another name.
    """
    usual: dict[str, Any] = dict(NOISES[validate.choice("noise", name, NOISES)])
    own = {**OF_JOINTS.get(name, {})}
    if name in OF_WHOLE:
        own |= {hand.joint_names[joint]: OF_WHOLE[name] for joint in hand.wrist}
    if not any(joint in own for joint in hand.joint_names):
        return usual
    joints = [{**usual, **own.get(joint, {})} for joint in hand.joint_names]
    differ = {each for figures in own.values() for each in figures}
    return usual | {each: np.array([figures[each] for figures in joints]) for each in differ}
