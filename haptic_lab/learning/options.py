"""What a preset may tell a learner: the keyword arguments of Stable-Baselines3 that a TOML file can say."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from haptic_env import validate

Check = Callable[[str, Any], object]
WIDEST, DEEPEST = 4096, 16  # of a network


def _number(low: float, high: float, *, above: float | None = None) -> Check:
    return partial(validate.number, low=low, high=high, above=above)


def _integer(low: int, high: int) -> Check:
    return partial(validate.integer, low=low, high=high)


def _entropy(what: str, value: Any) -> None:
    """A number, or the word "auto", which an underscore and the number to begin with may follow."""
    word, _, start = value.partition("_") if isinstance(value, str) else ("", "", "")
    if word != "auto":
        validate.number(f'{what}, if it is not "auto" or "auto_0.1",', value, -1e3, 1e3)
        return
    if value != "auto":
        try:
            begin: Any = float(start)
        except ValueError:
            begin = start
        validate.number(f"what follows auto_ in {what}", begin, 0.0, 1e3, above=0.0)


def _layers(what: str, value: Any) -> None:
    if not isinstance(value, list) or len(value) > DEEPEST:
        raise ValueError(f"{what} must be a list of at most {DEEPEST} widths of layers, got {value!r}")
    for width in value:
        validate.integer(f"width in {what}", width, 1, WIDEST)


def _networks(what: str, value: Any) -> None:
    if not isinstance(value, dict):
        _layers(what, value)
        return
    for name, layers in value.items():
        _layers(f"{validate.choice(f'network of {what}', name, ('pi', 'qf', 'vf'))} of {what}", layers)


def _table(valid: Mapping[str, Check]) -> Check:
    def check(what: str, value: Any) -> None:
        if not isinstance(value, dict):
            raise ValueError(f"{what} must be a table, got {value!r}")
        for name, each in value.items():
            valid[validate.choice(f"key of {what}", name, valid)](f"{name} of {what}", each)

    return check


FRACTION = _number(0.0, 1.0)
POSITIVE_FRACTION = _number(0.0, 1.0, above=0.0)
COUNT = _integer(1, 10**7)
SWITCH: Check = validate.boolean
POLICY_KEYWORDS: dict[str, Check] = {
    "net_arch": _networks,
    "log_std_init": _number(-20.0, 2.0),
    "use_sde": SWITCH,
    "use_expln": SWITCH,
    "normalize_images": SWITCH,
    "share_features_extractor": SWITCH,
    "optimizer_kwargs": _table({"eps": POSITIVE_FRACTION, "weight_decay": FRACTION}),
}
ACTOR_CRITIC: dict[str, Check] = {**POLICY_KEYWORDS, "ortho_init": SWITCH, "full_std": SWITCH, "squash_output": SWITCH}
COMMON: dict[str, Check] = {
    "learning_rate": POSITIVE_FRACTION,
    "gamma": FRACTION,
    "use_sde": SWITCH,
    "sde_sample_freq": _integer(-1, 10**7),
    "stats_window_size": COUNT,
    "verbose": _integer(0, 2),
}
PPO: dict[str, Check] = {
    **COMMON,
    "n_steps": COUNT,
    "batch_size": _integer(2, 10**7),
    "n_epochs": _integer(1, 1000),
    "gae_lambda": FRACTION,
    "clip_range": POSITIVE_FRACTION,
    "clip_range_vf": _number(0.0, 1e6, above=0.0),
    "normalize_advantage": SWITCH,
    "ent_coef": _number(-1e3, 1e3),
    "vf_coef": _number(0.0, 1e3),
    "max_grad_norm": _number(0.0, 1e6, above=0.0),
    "target_kl": _number(0.0, 1e3, above=0.0),
    "policy_kwargs": _table(ACTOR_CRITIC),
}
SAC: dict[str, Check] = {
    **COMMON,
    "buffer_size": COUNT,
    "learning_starts": _integer(0, 10**9),
    "batch_size": COUNT,
    "tau": POSITIVE_FRACTION,
    "train_freq": COUNT,
    "gradient_steps": _integer(-1, 10**6),
    "n_steps": _integer(1, 1000),
    "ent_coef": _entropy,
    "target_update_interval": COUNT,
    "target_entropy": _entropy,
    "use_sde_at_warmup": SWITCH,
    "optimize_memory_usage": SWITCH,
    "policy_kwargs": _table({**POLICY_KEYWORDS, "clip_mean": _number(0.0, 1e3), "n_critics": _integer(1, 16)}),
}
LSTM: dict[str, Check] = {
    **ACTOR_CRITIC,
    "lstm_hidden_size": _integer(1, WIDEST),
    "n_lstm_layers": _integer(1, DEEPEST),
    "shared_lstm": SWITCH,
    "enable_critic_lstm": SWITCH,
}
SEARCH: dict[str, Check] = {
    "population": _integer(4, 10_000),
    "worlds": _integer(1, 10_000),
    "step": _number(0.0, 10.0, above=0.0),
}
OPTIONS: dict[str, dict[str, Check]] = {
    "PPO": PPO,
    "SAC": SAC,
    "RecurrentPPO": {**PPO, "policy_kwargs": _table(LSTM)},
}


def check(algorithm: str, told: Any, raw: bool) -> None:
    """Check the keyword arguments of an algorithm.

    Args:
        algorithm: a name of `ALGORITHMS`.
        told: the keyword arguments.
        raw: whether it sees what is felt, several things by their names, and not one vector.

    Raises:
        ValueError: for one that it does not have, or out of its range.
    """
    if algorithm == "CMA-ES":
        _table(SEARCH)("[learner]", told)
        for name in SEARCH:
            if name not in told:
                raise ValueError(f"[learner] must set {name}")
        return
    policy = f"{'MultiInput' if raw else 'Mlp'}{'Lstm' if algorithm == 'RecurrentPPO' else ''}Policy"

    def kind(what: str, value: Any) -> None:
        validate.choice(f"{what} for this observation", value, (policy,))

    _table({"policy": kind, **OPTIONS[algorithm]})("[learner]", told)
    if "policy" not in told:
        raise ValueError(f'[learner] must set policy = "{policy}"')
