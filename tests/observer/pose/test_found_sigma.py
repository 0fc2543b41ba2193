"""σ that is to be found out."""

from __future__ import annotations

import numpy as np
import pytest

from observer import HapticSLAM, PoseOnly
from observer.pose.forward_model import ForwardModel

LOST_AT, SIGMA_DEG = 20, 3.0
OBSERVERS = {
    "pose_only": lambda hand, **keywords: PoseOnly(hand, None, **keywords),
    "haptic_slam": lambda hand, **keywords: HapticSLAM(hand, None, 3, **keywords),
}


@pytest.mark.filterwarnings("ignore:joint .* where it cannot be:RuntimeWarning")
@pytest.mark.parametrize("bias_deg", [0.0, 3.0])
@pytest.mark.parametrize("name", OBSERVERS)
@pytest.mark.parametrize("growth", [np.nan, np.inf, 1e160, 1e9])
def test_a_step_that_loses_the_filter_says_nothing_of_sigma(explore, monkeypatch, name, growth, bias_deg):
    """Whether its arithmetic breaks, or only what comes of it is no pose of a hand."""
    trial = explore("cube", 40, seed=3, sigma_deg=SIGMA_DEG, bias_deg=bias_deg)
    observer = OBSERVERS[name](trial.hand, bias_deg=bias_deg)
    observer.reset(seed=0, joint_angles=trial.hand.rest_pose)
    predict = ForwardModel.predict

    def wild(*told):
        prediction = predict(*told)
        return prediction._replace(transition=np.full_like(prediction.transition, growth))

    sigmas = []
    for step, felt in enumerate(zip(trial.torque, trial.felt, trial.contacts, strict=True)):
        if step == LOST_AT:
            with monkeypatch.context() as broken:
                broken.setattr(ForwardModel, "predict", wild)
                with pytest.warns(RuntimeWarning, match="the filter of the pose was lost"):
                    belief = observer.step(*felt)
        else:
            belief = observer.step(*felt)
        assert np.isfinite(belief.joint_angles).all()
        sigmas.append(observer.sigma_deg)
    assert sigmas[LOST_AT] == sigmas[LOST_AT - 1]
    assert len(set(sigmas)) == len(sigmas) - 1, "all other steps tell of it"
    assert 0.5 * SIGMA_DEG < sigmas[-1] < 2.0 * SIGMA_DEG
