"""Noises of felt angles to believe in, by name: keywords of `HapticSLAM`, `PoseOnly` and the environment.

**human**: a person who feels the joints of a hand that is not seen. SDs are the same for all joints: acuity is
comparable across the three joints of a finger.

- `bias_deg`, `drift_deg`: passive matching of wrist angles to a gauge, 32 healthy persons: total error 6.83° (RMS), of
  which 4.59° vary from trial to trial (Rinderknecht, Popp, Lambercy & Gassert 2016, Front. Hum. Neurosci. 10, 316).
  What varies is the drift; what a person is always wrong by is the bias: √(6.83² - 4.59²) = 5.1°. Of the index
  finger's metacarpophalangeal joint the mean error is 5.72° (Wycherley, Helliwell & Bird 2005, Rheumatology 44(5),
  638-641), an RMS of 7.2° if it is normal: much the same.
- `sigma_deg`: shoulder and elbow are known to 0.6 to 1.1° (van Beers, Sittig & Denier van der Gon 1998, Exp. Brain Res.
  122(4), 367-377). *Assumed*: that fingers are alike, and that this much is new at every step.
- `drift_seconds`: *assumed*, about as long as from one trial of such an experiment to the next. Measurements do not
  agree: unseen hands drift by 8 cm in 70 movements (Brown, Rosenbaum & Sainburg 2003, J. Neurophysiol. 90(5),
  3105-3118), or do not within 10 to 20 s (Desmurget, Vindras, Gréa, Viviani & Grafton 2000, Exp. Brain Res. 134(3),
  363-377).

**uncalibrated_glove**: a CyberGlove III whose calibration is that of other people.

- `bias_deg`: with the best calibration for each person most joints have an RMS error below 10°, with one across persons
  5 to 10° more (Heinrich et al. 2024, IEEE Sensors J. 24(9), doi 10.1109/JSEN.2024.3376606): 10 + 5. *Assumed*: that
  all of it is an offset; wrong gains are not modelled.
- `sigma_deg`: *assumed*, one step of a reading, which has 8 bits and is of the order of a degree (Fuchs, Moreau &
  Guitton 2011, Virtual Reality: Concepts and Technologies, chapter 7).
"""

from __future__ import annotations

NOISES: dict[str, dict[str, float]] = {
    "human": {"sigma_deg": 1.1, "bias_deg": 5.1, "drift_deg": 4.6, "drift_seconds": 10.0},
    "uncalibrated_glove": {"sigma_deg": 1.0, "bias_deg": 15.0},
}
