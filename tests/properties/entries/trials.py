"""What is said of people: their trials and the statistics of these."""

from __future__ import annotations

from typing import Any

from haptic_lab.people.trial_columns import read_trial_columns
from haptic_lab.people.trials import read_trials, write_trials
from tests.properties.entry import Entry
from tests.properties.files import file, out
from tests.properties.rule import Allowed

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


ENTRIES: dict[str, Entry] = {
    "haptic_lab.people.trials.read_trials": Entry(_read, {"path": file(".csv", *TRIALS).always}, FILE, weight=2),
    "haptic_lab.people.trial_columns.read_trial_columns": Entry(
        read_trial_columns, {"path": file(".toml", MAP).always}, FILE
    ),
}
