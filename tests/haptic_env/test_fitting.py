"""Capsules that stand for the geoms of a model."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from haptic_env.hands.fitting import capsules_of, misfit

GEOMS = {
    "capsule": ('type="capsule" size="0.01 0.03"', 1),
    "sphere": ('type="sphere" size="0.01"', 1),
    "cylinder": ('type="cylinder" size="0.01 0.03"', 1),
    "disc": ('type="cylinder" size="0.03 0.005"', 6),
    "ellipsoid": ('type="ellipsoid" size="0.01 0.012 0.03"', 1),
    "rod": ('type="box" size="0.01 0.012 0.03"', 1),
    "plate": ('type="box" size="0.005 0.02 0.03"', 4),
    "mesh": ('type="mesh" mesh="rod"', 1),
}
ROD = " ".join(f"{x} {y} {z}" for x in (-0.01, 0.01) for y in (-0.012, 0.012) for z in (-0.03, 0.03))


def model_of(geom: str) -> mujoco.MjModel:
    """A model with one geom, that lies anyhow."""
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><asset><mesh name="rod" vertex="{ROD}"/></asset><worldbody><body name="it">'
        f'<geom pos="0.1 0.02 -0.03" euler="30 40 50" {geom}/></body></worldbody></mujoco>'
    )


@pytest.mark.parametrize(("geom", "count"), GEOMS.values(), ids=GEOMS)
def test_it_has_the_place_and_nearly_the_size_of_the_geom(geom, count):
    model = model_of(geom)
    found = capsules_of(model, 0)
    assert len(found) == count
    middle = np.mean([0.5 * (each.start + each.end) for each in found], axis=0)
    np.testing.assert_allclose(middle, model.geom_pos[0], atol=1e-6)
    out, bare = misfit(model, 0, found)
    thin = np.sort(model.geom_aabb[0, 3:])[0]
    assert out < 0.5 * thin
    assert bare < 1.1 * thin


@pytest.mark.parametrize("geom", ["capsule", "sphere"])
def test_what_is_round_is_itself(geom):
    model = model_of(GEOMS[geom][0])
    out, bare = misfit(model, 0, capsules_of(model, 0))
    assert max(out, bare) < 6e-4  # half of the shortest bone


def test_a_plane_is_no_skin():
    model = mujoco.MjModel.from_xml_string('<mujoco><worldbody><geom type="plane" size="1 1 1"/></worldbody></mujoco>')
    with pytest.raises(ValueError, match="is a plane; skin is sphere, capsule"):
        capsules_of(model, 0)
