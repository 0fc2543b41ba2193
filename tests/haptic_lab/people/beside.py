"""People and observers that are made up, for tests of what is said of both."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

NAMES = ("cube", "sphere", "cone", "cylinder")
LEVELS = (1.05, 1.1, 1.15, 1.2, 1.3)


def ellipsoid(level: float) -> str:
    return f"ellipsoid(1, 1, {level:g})"


def people(right: float = 0.7, subjects: int = 3, each: int = 5, seed: int = 900_020) -> pd.DataFrame:
    """Who say the right name so often after 5 s, and less often after 2 s, and any other otherwise."""
    rng, rows = np.random.default_rng(seed), []
    for subject in range(subjects):
        for seconds, share in ((2.0, right - 0.2), (5.0, right)):
            for name in NAMES:
                for _ in range(each):
                    others = [other for other in NAMES if other != name]
                    response = name if rng.random() < share else str(rng.choice(others))
                    rows.append((f"S{subject}", name, response, seconds, rng.uniform(1, 3)))
    return pd.DataFrame(rows, columns=["subject", "object", "response", "seconds", "response_time"])


def sweep(folder: Path, sure: dict[str, float], times: tuple[float, ...] = (2.0, 5.0), repeats: int = 10) -> Path:
    """Results of `evaluate`: each observer is as sure of the true name, or of another one in a tenth of the trials."""
    folder.mkdir()
    rows = []
    for observer, probability in sure.items():
        for seconds in times:
            for name in NAMES:
                for seed in range(repeats):
                    wrong = probability < 1.0 and seed == 0
                    said = NAMES[(NAMES.index(name) + wrong) % len(NAMES)]
                    rest = (1.0 - probability) / (len(NAMES) - 1)
                    rows.append(
                        {
                            **{"observer": observer, "sigma_deg": 3.0, "seconds": seconds, "shape": name, "seed": seed},
                            "time_to_decision": seconds / (2 + seed) if probability > 0.9 else np.nan,
                            **{f"p_{other}": probability if other == said else rest for other in NAMES},
                        }
                    )
    pd.DataFrame(rows).to_csv(folder / "trials.csv", index=False)
    return folder


def judges(thresholds: tuple[float, ...] = (1.12, 1.16), each: int = 20, seed: int = 900_021) -> pd.DataFrame:
    """Who say whether an ellipsoid is long."""
    rng, rows = np.random.default_rng(seed), []
    for subject, threshold in enumerate(thresholds):
        for level in LEVELS:
            share = 0.02 + 0.96 / (1 + np.exp(-(level - threshold) / 0.025))
            rows += [
                (f"S{subject}", ellipsoid(level), "yes" if rng.random() < share else "no", 5.0) for _ in range(each)
            ]
    return pd.DataFrame(rows, columns=["subject", "object", "response", "seconds"])
