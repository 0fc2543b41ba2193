"""Every entry point of the public interface by its name, area by area; what has none is `LEFT_OUT`, with a reason.

Add a new public function as one line to the `ENTRIES` of its area: its parameters, by kind. Registries of the packages
are gone through by themselves.
"""

from __future__ import annotations

import observer
from tests.properties import samples
from tests.properties.entries import (
    agents,
    beliefs,
    commands,
    environment,
    geometry,
    learnt,
    naming,
    observers,
    people,
    recordings,
    trials,
)
from tests.properties.entry import Entry

AREAS: dict[str, dict[str, Entry]] = {
    "environment": environment.ENTRIES,
    "shapes": geometry.ENTRIES,
    "recordings": recordings.ENTRIES,
    "observers": observers.ENTRIES,
    "beliefs": beliefs.ENTRIES,
    "naming": naming.ENTRIES,
    "learnt": learnt.ENTRIES,
    "agents": agents.ENTRIES,
    "commands": commands.ENTRIES,
    "people": people.ENTRIES,
    "trials": trials.ENTRIES,
}
ENTRIES: dict[str, Entry] = {name: entry for area in AREAS.values() for name, entry in area.items()}


def prepare(area: str) -> None:
    """Compile what the entries of `area` need, which takes longer than any input may."""
    if area not in ("shapes", "recordings", "people", "trials"):
        observer.warm_up(samples.hand())
        observers.prepare()


MODULES = (
    "haptic_env.explore",
    "haptic_env.grid",
    "haptic_env.hand",
    "haptic_env.hands",
    "haptic_env.patches",
    "haptic_env.pose",
    "haptic_env.reading",
    "haptic_env.recordings",
    "haptic_env.replay",
    "haptic_env.sensors",
    "haptic_env.shapes",
    "observer",
    "observer.classifiers",
    "observer.metrics",
    "observer.shape.fading",
    "observer.variants",
    "agents",
    "agents.few_joints",
    "agents.follow_recording",
    "agents.hold_action",
    "agents.repeat_torques",
    "agents.sb3",
    "agents.synergy",
    "haptic_lab.people.courses",
    "haptic_lab.people.agreement",
    "haptic_lab.people.detection",
    "haptic_lab.people.psychometric",
    "haptic_lab.people.studies.presets",
    "haptic_lab.people.trials",
    "haptic_lab.people.trial_columns",
)
BUILT = "made by the packages, and handed out; what is given to it was checked before"
LEFT_OUT: dict[str, str] = {
    "haptic_env.hand.parse": "reads the MJCF that hands are built from, which ships",
    "haptic_env.patches.Link": BUILT,
    "haptic_env.patches.PatchLayout": BUILT,
    "haptic_env.patches.Patches": "made by haptic_env.hands.make, whose keywords are its own",
    "haptic_env.patches.SkinPoints": BUILT,
    "haptic_env.patches.patch_at": "compiled, within the bounds that Patches keeps",
    "haptic_env.patches.row_at": "compiled, within the bounds that Patches keeps",
    "haptic_env.recordings.ColumnMap": BUILT,
    "haptic_env.recordings.MeasuredTouch": BUILT,
    "haptic_env.recordings.ObserverInputs": "a tuple of arrays, which Recording checks",
    "haptic_env.recordings.Track": "a tuple of arrays, which Recording checks",
    "haptic_env.reading.content": "whoever asks says which file it was: recordings.read",
    "haptic_env.reading.npy": "whoever asks says which file it was: agents.synergy.posture_basis",
    "haptic_env.reading.text": "whoever asks says which file it was: recordings.read",
    "haptic_env.reading.toml": "whoever asks says which file it was: recordings.read_calibration, presets.read",
    "haptic_env.replay.steady_rate": "asked by Playback, which has an entry",
    "haptic_env.replay.roots": "asked by Playback and KinematicReplay, which have entries",
    "haptic_env.sensors.Lasting": "what Bias and Drift have in common",
    "haptic_env.sensors.FeltAngles": "made by ExploreEnv.felt_at, of sensors that have entries",
    "haptic_env.shapes.Shape": "abstract; SHAPES has them all",
    "observer.Belief": BUILT,
    "observer.ContactsDoNotFit": "a warning, which ShapePosterior gives",
    "observer.DamagedEntry": "a warning, which Library gives",
    "observer.DeadReckoning": "OBSERVERS has it, as floor",
    "observer.Kalman": "OBSERVERS has it",
    "observer.Smoother": "OBSERVERS has it",
    "observer.TruePose": "OBSERVERS has it, as ceiling",
    "observer.White": "OBSERVERS has it, as white",
    "observer.shape.fading.FadingNames": "made by ShapePosterior, of a time constant that it checks",
    "observer.shape.fading.check": "asked by faded and ShapePosterior, which have entries",
    "observer.shape.fading.fade": "the equation, of arrays that faded checks",
    "observer.classifiers.AlignedNearestNeighbour": "CLASSIFIERS has it",
    "observer.classifiers.MapClassifier": "abstract; CLASSIFIERS has them all",
    "observer.classifiers.NearestNeighbour": "CLASSIFIERS has it",
    "observer.classifiers.ShapeLikelihood": "CLASSIFIERS has it",
    "observer.metrics.Reliability": BUILT,
    "observer.metrics.Share": BUILT,
    "observer.metrics.SurfaceScore": BUILT,
    "agents.Guided": "abstract; POLICIES has them all",
    "agents.Policy": "abstract; POLICIES has them all",
    "haptic_lab.people.agreement.Correlation": BUILT,
    "haptic_lab.people.detection.Efficiency": BUILT,
    "haptic_lab.people.detection.Sensitivity": BUILT,
    "haptic_lab.people.detection.efficiency": "of what yes_no and forced_choice make, which have entries",
    "haptic_lab.people.detection.group_draws": "of what efficiency has checked",
    "haptic_lab.people.psychometric.Estimate": BUILT,
    "haptic_lab.people.psychometric.Psychometric": BUILT,
    "haptic_lab.people.studies.presets.HandCondition": "of a study's file, which read has an entry for",
    "haptic_lab.people.studies.presets.Published": "of a study's file, which read has an entry for",
    "haptic_lab.people.studies.presets.Study": "of a study's file, which read has an entry for",
    "haptic_lab.people.studies.presets.names": "takes nothing",
    "haptic_lab.people.trial_columns.TrialColumns": "read_trial_columns has an entry",
    "haptic_lab.people.trial_columns.typed": "the flags of commands, which have entries",
    "haptic_lab.people.trials.check_trials": "what read_trials, which has an entry, asks of each table",
    "haptic_lab.people.trials.write_trials": "written and read again in the entry of read_trials",
    "agents.sb3.is_model": "agents has it",
    "agents.sb3.load_model": "agents has it",
    "agents.sb3.Trained": "POLICIES has it",
    "agents.synergy.Synergy": "POLICIES has it",
    "agents.synergy.opposition_basis": "takes a hand alone",
}
