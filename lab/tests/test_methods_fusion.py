"""Fusion by inverse variance: every number here can be worked out by hand."""

import numpy as np
import pytest

from asset2sim.physics.inertia import tensor_of
from lab.methods.fusion import fuse, inverse_variances
from schemas.overlay import JointProposal, LinkProposal, Overlay
from tests.assets import near


def answer(scale: float = 1.0, sigma: float | None = None, **fields: object) -> Overlay:
    sigmas = {} if sigma is None else {"scale": sigma}
    return Overlay.model_validate({"scale": scale, "sigmas": sigmas} | fields)


def lid(**fields: object) -> tuple[LinkProposal, ...]:
    return (LinkProposal.model_validate({"name": "lid"} | fields),)


def hinge(**fields: object) -> tuple[JointProposal, ...]:
    return (JointProposal.model_validate({"name": "hinge"} | fields),)


@pytest.mark.parametrize(
    ("said", "scale"),
    [
        ([(1.0, 0.1), (2.0, 0.2)], (100 * 1 + 25 * 2) / 125), ([(1.0, None), (2.0, None), (6.0, None)], 3.0),
        *(([(1.0, 0.1), (2.0, 0.2), (3.0, 0.4), (4.0, unstated)], (100 * 1 + 25 * 2 + 6.25 * 3 + 25 * 4) / 156.25)
          for unstated in (None, 0.0)),
    ],
    ids=["by inverse variance", "alike without sigmas", "a missing one is the median of the others", "so is zero"],
)  # fmt: skip
def test_a_scale_is_weighted_by_how_sure_its_answers_are(said: list[tuple[float, float | None]], scale: float) -> None:
    assert near(fuse([answer(*item) for item in said]).scale, scale)


def test_weights_sum_to_one_however_small_or_large_the_sigmas() -> None:
    for sigmas in ([1e-200, 1e-200], [1e200, 1e-200], [1e300, 1e300, None]):
        assert near(sum(inverse_variances(sigmas)), 1.0)
    assert near(inverse_variances([1e-200, 2e-200]), [0.8, 0.2])


def test_every_number_of_a_link_and_a_joint_is_fused_with_its_own_sigma() -> None:
    paths = {"links.lid.mass_kg": 1.0, "joints.hinge.damping": 3.0, "joints.hinge.friction": 1.0}
    other = {"links.lid.mass_kg": 2.0, "joints.hinge.damping": 1.0, "joints.hinge.friction": 3.0}
    one = answer(links=lid(mass_kg=1.0), joints=hinge(damping=0.1, friction=0.0, stiffness=2.0), sigmas=paths)
    two = answer(links=lid(mass_kg=2.0), joints=hinge(damping=0.2, friction=1.0, stiffness=0.0), sigmas=other)
    fused = fuse([one, two])
    assert near(fused.links[0].mass_kg, 0.8 * 1.0 + 0.2 * 2.0)
    assert near(fused.joints[0].damping, 0.1 * 0.1 + 0.9 * 0.2)
    assert near(fused.joints[0].friction, 0.1)
    assert near(fused.joints[0].stiffness, 1.0), "no answer states its sigma"


def test_a_number_is_fused_over_those_who_state_it() -> None:
    fused = fuse([answer(links=lid(mass_kg=1.0)), answer(links=lid(mass_kg=3.0)), answer(links=lid()), answer()])
    assert fused.links == lid(mass_kg=2.0)


def test_the_components_of_an_inertia_share_one_weight_so_that_it_stays_positive_definite() -> None:
    rng = np.random.default_rng(3)
    answers = []
    for sigma in (0.1, 0.3, 5.0):
        root = rng.normal(size=(3, 3))
        m = root @ root.T + 1e-6 * np.eye(3)
        six = (m[0, 0], m[0, 1], m[0, 2], m[1, 1], m[1, 2], m[2, 2])
        answers.append(answer(links=lid(mass_kg=1.0, inertia=six), sigmas={"links.lid.inertia": sigma}))
    fused = fuse(answers).links[0].inertia
    weights = np.array([1 / 0.1**2, 1 / 0.3**2, 1 / 5.0**2])
    wanted = weights @ np.array([item.links[0].inertia for item in answers]) / weights.sum()
    assert fused is not None and near(fused, wanted)
    assert np.linalg.eigvalsh(tensor_of(fused)).min() > 0.0


def test_a_centre_of_mass_is_fused_by_component() -> None:
    one, two = lid(com=(0.0, 1.0, -1.0)), lid(com=(1.0, 1.0, 1.0))
    fused = fuse([answer(links=one), answer(links=two)])
    assert fused.links[0].com == (0.5, 1.0, 0.0)


def test_a_state_needs_more_weight_than_none() -> None:
    opened = answer(1.0, initial_joint_positions={"hinge": 0.5}, asked=("hinge",))
    wider = answer(1.0, initial_joint_positions={"hinge": 0.7}, asked=("hinge",))
    none = answer(1.0)
    assert fuse([opened, wider, none]).initial_joint_positions == {"hinge": pytest.approx(0.6)}
    assert fuse([opened, wider, none]).asked == ("hinge",)
    assert fuse([opened, none]).initial_joint_positions == {}, "equal votes do not carry"
    assert fuse([opened, none, none]).asked == ()


def test_who_is_surer_of_numbers_has_more_weight_in_votes() -> None:
    sure = answer(1.0, 0.1, initial_joint_positions={"hinge": 0.5}, contact_material="steel")
    unsure = answer(1.0, 1.0, contact_material="wood")
    fused = fuse([unsure, sure, unsure])
    assert fused.contact_material == "steel" and set(fused.initial_joint_positions) == {"hinge"}
    same = fuse([answer(1.0, 1.0, contact_material="wood"), *[sure.model_copy(update={"sigmas": {}})] * 2])
    assert same.contact_material == "steel"


def test_materials_and_holds_go_to_the_majority_and_of_equals_to_the_first() -> None:
    steel, wood = lid(material="steel"), lid(material="wood")
    assert fuse([answer(links=steel), answer(links=wood)]).links[0].material == "steel"
    assert fuse([answer(links=steel), answer(links=wood), answer(links=wood)]).links[0].material == "wood"
    assert fuse([answer(links=lid()), answer(links=lid()), answer(links=wood)]).links[0].material == "wood"
    yes, silent = hinge(holds=True), hinge()
    assert fuse([answer(joints=yes), answer(joints=yes), answer(joints=silent)]).joints[0].holds is True
    assert fuse([answer(joints=yes), answer(joints=silent), answer()]).joints[0].holds is None


def test_where_a_spring_rests_is_stated_only_where_most_state_it() -> None:
    spring, slack = hinge(stiffness=1.0, spring_rest=0.4), hinge(stiffness=0.0)
    fused = fuse([answer(joints=spring), answer(joints=slack), answer(joints=slack)]).joints[0]
    assert fused.spring_rest is None and near(fused.stiffness, 1.0 / 3.0)
    assert near(fuse([answer(joints=spring), answer(joints=spring)]).joints[0].spring_rest, 0.4)


def test_one_answer_is_its_own_fusion() -> None:
    one = answer(
        0.3, 0.1, links=lid(mass_kg=0.7, inertia=(1.0, 0.1, 0.0, 1.0, 0.0, 1.0), material="oak", hollow_factor=1.0),
        joints=hinge(damping=0.1, friction=0.0, stiffness=0.0, holds=True), initial_joint_positions={"hinge": 0.2},
        asked=("scale", "hinge"), contact_material="wood",
    )  # fmt: skip
    for count in (1, 7):
        fused = fuse([one] * count)
        assert fused.model_copy(update={"sigmas": one.sigmas, "notes": ()}) == one


def test_shares_stay_shares_and_extremes_stay_finite() -> None:
    full = answer(1e308, links=lid(hollow_factor=1.0))
    fused = fuse([full] * 3)
    assert fused.links[0].hollow_factor == 1.0 and fused.scale == 1e308


def test_nothing_cannot_be_fused() -> None:
    with pytest.raises(ValueError, match="no answer"):
        fuse([])
