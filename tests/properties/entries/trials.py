"""What is said of people: their trials and the statistics of these."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st

from haptic_lab.people import agreement, detection, psychometric
from haptic_lab.people.trial_columns import read_trial_columns
from haptic_lab.people.trials import read_trials, write_trials
from tests.properties.entry import Entry
from tests.properties.files import file, out
from tests.properties.parameters import Parameter, array, integer, number, several
from tests.properties.parameters import name as name_of
from tests.properties.rule import Allowed
from tests.properties.strategies import odd_arrays, odd_names, odd_numbers

FILE = Allowed(files=True, words=("input", "trials", "table"), nan=True, nan_of_nan=True)
TRIALS = (
    b"subject,object,response,seconds,confidence,response_time,condition,trial,age\n"
    b"A,cube,sphere,2.5,0.7,1.5,one,1,30\nA,ellipsoid(1.1),none,3,,,two,2,30\nB,cube,yes,1e1,1,0.5,one,1,\n",
    b"subject;object;response;seconds\r\nA;cube;cube;1.5\r\nB;cube;no;2\r\n",
)
MAP = b"""[columns]
subject = "vp"
seconds = 5.0
[units]
confidence = "percent"
[names]
egg = "ellipsoid(1.1)"
"""


def _read(path: Any) -> Any:
    """What is read is written, and read again as it was."""
    table = read_trials(path)
    place = out("again.tsv")
    write_trials(table, place)
    again = read_trials(place)
    assert list(again["response"]) == list(table["response"])
    return table[["seconds", "trial"]].to_numpy()


def _sensitivity(found: detection.Sensitivity) -> Any:
    return found.d_prime, found.d_prime_draws, found.d_prime_interval, found.trials, detection.efficiency(found, IDEAL)


IDEAL = detection.forced_choice(90, 100, 2)
ANSWERS = ("cube", "sphere")
SHARES = Parameter(st.just(np.array([[0.25, 0.75], [1.0, 0.0]])), odd_arrays((2, 2)))
TWO = {
    "responses": Parameter(st.just(["cube", "sphere"]), st.lists(odd_names, max_size=3)).always,
    "shares": SHARES.always,
}
COUNTS = {
    "levels": array((4,), 1.0, 2.0).always,
    "counted": Parameter(st.just(np.array([1.0, 2.0, 3.0, 4.0])), odd_arrays((4,))).always,
    "trials": Parameter(st.just(np.full(4, 5.0)), odd_arrays((4,))).always,
}
PERFECT = Allowed(infinite=True, words=("share",))
NUMBERS = Allowed(
    nan=True, nan_of_nan=True, infinite=True, words=("trials", "answers", "times", "probabilities", "answered")
)
ENTRIES: dict[str, Entry] = {
    "haptic_lab.people.trials.read_trials": Entry(_read, {"path": file(".csv", *TRIALS).always}, FILE, weight=2),
    "haptic_lab.people.trial_columns.read_trial_columns": Entry(
        read_trial_columns, {"path": file(".toml", MAP).always}, FILE
    ),
    "haptic_lab.people.detection.share_correct": Entry(
        detection.share_correct, {"d_prime": array((3,), -2.0, 4.0).always, "alternatives": integer(2, 9).always}
    ),
    "haptic_lab.people.detection.d_prime_of": Entry(
        detection.d_prime_of, {"share": number(0.01, 0.99).always, "alternatives": integer(2, 9).always}
    ),
    "haptic_lab.people.detection.yes_no": Entry(
        lambda **call: _sensitivity(detection.yes_no(**call)),
        {
            "hits": integer(0, 5).always,
            "signals": integer(5, 9).always,
            "false_alarms": integer(0, 5).always,
            "noises": integer(5, 9).always,
            "seed": integer(0, 9),
        },
        PERFECT,
    ),
    "haptic_lab.people.detection.forced_choice": Entry(
        lambda **call: _sensitivity(detection.forced_choice(**call)),
        {
            "correct": integer(0, 5).always,
            "trials": integer(5, 9).always,
            "alternatives": integer(2, 9).always,
            "seed": integer(0, 9),
        },
        PERFECT,
    ),
    "haptic_lab.people.agreement.log_likelihoods": Entry(
        lambda responses, shares, **call: agreement.log_likelihoods(responses, shares, ANSWERS, **call),
        {**TWO, "floor": number(0.0, 1.0)},
        NUMBERS,
    ),
    "haptic_lab.people.agreement.kappa": Entry(
        lambda responses, shares: agreement.kappa(responses, shares, ANSWERS), TWO, NUMBERS
    ),
    "haptic_lab.people.agreement.shared_bits": Entry(
        lambda responses, shares: agreement.shared_bits(responses, shares, ANSWERS), TWO, NUMBERS
    ),
    "haptic_lab.people.agreement.time_correlation": Entry(
        agreement.time_correlation, {"one": array((9,)).always, "other": array((9,)).always}, NUMBERS
    ),
    "haptic_lab.people.psychometric.level_of": Entry(
        psychometric.level_of, {"objects": several(name_of(["ellipsoid(1.1)", "ellipsoid(1.2)", "cube"])).always}
    ),
    "haptic_lab.people.psychometric.fit_psychometric": Entry(
        psychometric.fit_psychometric,
        {**COUNTS, "alternatives": Parameter(st.just(2), odd_numbers).always},
        NUMBERS,
        weight=0.2,
    ),
}
