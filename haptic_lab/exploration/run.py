"""Sets up one exploration (environment, policy, candidates) and runs it with the observer and its floor side by
side."""

from __future__ import annotations

import signal
import time
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Console

from haptic_env import hand_env, hand_of, registration, shapes
from haptic_env.recordings import MeasuredTouch, Recording
from haptic_lab import possible, replay
from haptic_lab.exploration import learnt
from haptic_lab.exploration.screen import Screen
from haptic_lab.exploration.settings import OBSERVER, RAW, SECONDS, ExplorationSettings
from haptic_lab.limits import NONE as NO_LIMITS
from haptic_lab.limits import Limits
from haptic_lab.records import BeliefTrace, Exploration
from haptic_lab.trial import Trial, check_model, guided, make_observers
from observer.variants import VARIANTS, Observer

if TYPE_CHECKING:
    from haptic_lab.view.trial_view import TrialView


def begin(settings: ExplorationSettings, recording: Recording | MeasuredTouch | None) -> replay.ExplorationSession:
    """Set up an exploration.

    Args:
        settings: of the exploration.
        recording: that the hand repeats, if it does.

    Returns:
        The environment, and who acts and names in it.

    Raises:
        ValueError: for a recording or a trained model that does not fit.
    """
    if recording is not None:
        return replay.session(settings, recording)
    env = registration.make(
        settings.env,
        wrist=settings.wrist,
        shape=settings.shape if settings.shape or settings.objects is None else shapes.read_set(settings.objects),
        scale=settings.scale,
        **settings.noise,
        **settings.jitter,
        episode_seconds=SECONDS if settings.seconds is None else settings.seconds,
        reveal_truth=True,  # for the observer's judge alone
    )
    hand = hand_of(env)
    namer, candidates = learnt.naming(settings, hand, possible.chosen(settings, hand))
    check_model(env, settings.policy, namer, settings.trust)
    return replay.ExplorationSession(env, settings.policy, candidates, namer)


def make_trial(
    settings: ExplorationSettings,
    session: replay.ExplorationSession,
    names: Sequence[str] = (RAW, OBSERVER),
    naming: Collection[str] = (OBSERVER,),
    limits: Limits = NO_LIMITS,
    **keywords: Any,
) -> Trial:
    """Make who acts and who observes.

    Args:
        settings: of the exploration.
        session: what `begin` returns.
        names: of the observers; those that are no brackets are informed.
        naming: those that name the object.
        limits: of the observers that are called limited.
        **keywords: what else the trial is told.

    Returns:
        The trial, not begun.

    Raises:
        ValueError: for a policy that does not fit the environment.
    """
    observers: dict[str, Observer] = {}
    rate = hand_env(session.env).control_hz
    noise = settings.told(settings.noise, session.hand)
    for name in names:
        informed = session.informed if name.split("+")[0] in (OBSERVER, *VARIANTS) else {}
        told = {"control_hz": rate, **noise, **session.told, **informed}
        observers |= make_observers((name,), session.hand, particles=settings.particles, limits=limits, **told)
    env = session.env
    if isinstance(session.policy, str):
        env = guided(env, session.policy, shape=session.namer, **noise)
    told = {"naming": naming, "trust": settings.trust, "limits": limits, **keywords}
    return Trial(env, session.policy, observers, session.namer, settings.seed, **told)


def explore(
    trial: Trial, console: Console, view: TrialView | None = None
) -> tuple[Exploration, dict[str, BeliefTrace], float, bool]:
    """Run an exploration; Ctrl-C ends it at the next step, a second one at once.

    Args:
        trial: what `make_trial` returns; its environment is closed.
        console: shows how it goes.
        view: shows it too; None: nobody looks.

    Returns:
        What happened, what the observers believed, by name, how many seconds it took, and whether it was cut short.

    Raises:
        ValueError: for an object that the hand cannot hold.
    """
    stop = False

    def interrupt(*_: object) -> None:
        nonlocal stop
        stop = True
        signal.signal(signal.SIGINT, signal.default_int_handler)  # a second one ends it at once

    usual = signal.signal(signal.SIGINT, interrupt)
    try:
        with Screen(console, trial) as screen:
            start = time.perf_counter()
            for step in trial:  # between two steps everything is whole
                screen.show(step)
                if view is not None:
                    view.show(step)
                if stop:
                    break
        exploration, traces = trial.finish()
        if view is not None:
            view.finish(exploration, traces[OBSERVER])
        return exploration, traces, time.perf_counter() - start, stop
    finally:
        signal.signal(signal.SIGINT, usual)
        trial.env.close()
