"""Every classifier of maps keeps scikit-learn's contract; each against a plain computation of what it claims."""

from __future__ import annotations

import re

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.calibration import CalibratedClassifierCV
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.ensemble import RandomForestClassifier
from sklearn.svm import SVC, LinearSVC

from haptic_env import hands, shapes
from haptic_env.grid import Grid
from observer import classifiers
from observer.classifiers import CLASSIFIERS, NearestNeighbour, ScikitLearn, ShapeLikelihood
from observer.classifiers.base import touch_evidence

GRID = Grid.around((0, 0, 0), (0.08, 0.08, 0.08), 0.004)
SHAPE = (4, 5, 6)


@pytest.fixture(params=CLASSIFIERS)
def name(request: pytest.FixtureRequest) -> str:
    """Every registered classifier's name."""
    return request.param


@pytest.fixture
def classifier(name: str):
    """Every registered classifier."""
    return classifiers.make(name)


def _maps(count: int, seed: int = 0) -> np.ndarray:
    """Random occupancies with half of the voxels unknown."""
    rng = np.random.default_rng(seed)
    return np.where(rng.random((count, *SHAPE)) < 0.5, 0.5, rng.random((count, *SHAPE)))


def test_probabilities_are_in_the_order_of_the_classes(classifier):
    maps, labels = _maps(6), ["pear", "apple", "fig", "apple", "pear", "fig"]
    assert classifier.fit(maps, labels) is classifier
    np.testing.assert_array_equal(classifier.classes_, ["apple", "fig", "pear"])
    for each in _maps(5, seed=1):
        p = classifier.predict_proba(each)
        assert p.shape == (3,)
        assert p.dtype == np.float64
        assert (p >= 0).all()
        assert p.sum() == pytest.approx(1)
        assert classifier.predict(each) == classifier.classes_[p.argmax()]
        assert type(classifier.predict(each)) is str


def test_the_order_of_the_maps_does_not_matter(name):
    maps, labels = _maps(6), np.array(["pear", "apple", "fig", "apple", "pear", "fig"])
    order = np.array([3, 1, 5, 0, 2, 4])
    first = classifiers.make(name).fit(maps, labels)
    second = classifiers.make(name).fit(maps[order], labels[order])
    for each in _maps(5, seed=1):
        np.testing.assert_allclose(first.predict_proba(each), second.predict_proba(each), rtol=1e-9)


def test_one_class_is_certain(classifier):
    classifier.fit(_maps(2), ["only", "only"])
    np.testing.assert_array_equal(classifier.predict_proba(_maps(1, seed=3)[0]), [1.0])
    assert classifier.predict(_maps(1, seed=3)[0]) == "only"


def test_fitting_again_forgets(classifier):
    classifier.fit(_maps(3), ["a", "b", "c"])
    classifier.fit(_maps(2, seed=1)[:, :, :, :3], ["x", "y"])
    assert classifier.predict_proba(_maps(1)[0][:, :, :3]).shape == (2,)


def test_nothing_that_is_handed_in_is_changed(classifier):
    maps, probe = _maps(3), _maps(1, seed=2)[0]
    before = maps.copy(), probe.copy()
    classifier.fit(maps, ["a", "b", "c"])
    p = classifier.predict_proba(probe)
    np.testing.assert_array_equal(maps, before[0])
    np.testing.assert_array_equal(probe, before[1])
    maps[:] = 0.1
    np.testing.assert_array_equal(classifier.predict_proba(probe), p)


def test_true_maps_are_named(classifier):
    """Fitted on the true occupancies, each is the nearest to itself."""
    truth = {name: shapes.make(name).occupancy(GRID).astype(float) for name in shapes.SHAPES}
    classifier.fit(list(truth.values()), list(truth))
    for name, occupancy in truth.items():
        assert classifier.predict(occupancy) == name


def test_an_unfitted_classifier_says_so(classifier):
    for ask in (classifier.predict, classifier.predict_proba):
        with pytest.raises(ValueError, match=r"not fitted yet: call fit\(maps, labels\)"):
            ask(_maps(1)[0])


BAD_MAPS = {
    "another shape": (np.full((4, 5, 7), 0.5), r"of shape \(4, 5, 6\).*got \(4, 5, 7\)"),
    "flat": (np.full((4, 5), 0.5), r"shape \(X, Y, Z\), must be .* of 3 dimensions, got shape \(4, 5\)"),
    "NaN": (np.full(SHAPE, np.nan), r"finite numbers.*, got nan at index \(0, 0, 0\)"),
    "above one": (np.full(SHAPE, 1.1), r"probabilities in \[0, 1\], got 1\.1 at"),
    "log-odds": (np.full(SHAPE, -3.0), r"probabilities in \[0, 1\], got -3\.0 at"),
    "complex": (np.full(SHAPE, 0.5 + 0j), r"finite numbers.*got array.*0\.j"),
    "masked": (np.ma.array(np.full(SHAPE, 0.5), mask=True), "finite numbers.*got masked_array"),
    "objects": (np.full(SHAPE, None), "finite numbers.*got array.*None"),
    "text": (np.full(SHAPE, "0.5"), "finite numbers.*got array.*'0.5'"),
    "empty": (np.empty((0, 5, 6)), r"a voxel at least, got shape \(0, 5, 6\)"),
    "nothing": (None, "finite numbers.*got None"),
}


def test_impossible_maps_are_refused(classifier):
    classifier.fit(_maps(2), ["a", "b"])
    for case, (bad, message) in BAD_MAPS.items():
        with pytest.raises(ValueError, match=message):
            classifier.predict(bad)
        if case != "another shape":
            with pytest.raises(ValueError, match=message):
                classifier.fit([bad, bad], ["a", "b"])


@pytest.mark.parametrize(("maps", "labels"), [([], []), (_maps(2), ["a"]), (_maps(1), ["a", "b"])])
def test_maps_and_labels_that_do_not_match_are_refused(classifier, maps, labels):
    with pytest.raises(ValueError, match=f"as many labels as maps, at least one: got {len(maps)} and {len(labels)}"):
        classifier.fit(maps, labels)


NO_TEXT = {
    "numbers": [10, 9],
    "switches": [True, False],
    "NaN": ["cube", float("nan")],
    "nothing": ["cube", None],
    "bytes": [b"cube", b"ball"],
    "an array of numbers": np.array([1, 2]),
    "a zero": ["cube", "ball\0"],
}


@pytest.mark.parametrize("case", NO_TEXT)
def test_labels_that_are_no_text_are_refused_with_their_value(classifier, case):
    wrong = next(each for each in NO_TEXT[case] if each != "cube")
    with pytest.raises(ValueError, match=f"^labels must be text, got {re.escape(repr(wrong))}$"):
        classifier.fit(_maps(2), NO_TEXT[case])


@pytest.mark.parametrize("labels", ["ab", 2, None, np.array("a"), np.ma.array(["a", "b"], mask=[0, 1])], ids=str)
def test_labels_are_a_list(classifier, labels):
    with pytest.raises(ValueError, match="labels must be a list, got"):
        classifier.fit(_maps(2), labels)


@pytest.mark.parametrize("labels", [["a", "b"], ("a", "b"), np.array(["a", "b"]), np.array(["a", "b"], object)])
def test_labels_come_back_as_they_were_given(classifier, labels):
    assert classifier.fit(_maps(2), labels).classes_.tolist() == ["a", "b"]
    assert classifier.predict(_maps(2)[1]) in ("a", "b")


@pytest.mark.parametrize("maps", [None, 3, "maps", np.float64(0.5)])
def test_maps_are_a_list(classifier, maps):
    with pytest.raises(ValueError, match="maps must be a list, got"):
        classifier.fit(maps, ["a", "b"])


def test_maps_of_several_shapes_are_refused(classifier):
    maps = [np.full((4, 5, 6), 0.5), np.full((4, 5, 7), 0.5)]
    with pytest.raises(ValueError, match=r"one shape, got \(4, 5, 6\), \(4, 5, 7\)"):
        classifier.fit(maps, ["a", "b"])


@pytest.mark.parametrize("name", ["shape_likelihood", "aligned_nearest_neighbour"])
@pytest.mark.parametrize("bandwidth", [1e-6, 1e6])
def test_however_narrow_or_wide_the_window_probabilities_are_numbers(name, bandwidth):
    model = classifiers.make(name, bandwidth=bandwidth).fit(_maps(3), ["a", "b", "c"])
    p = model.predict_proba(_maps(1, seed=3)[0])
    assert np.isfinite(p).all()
    assert p.sum() == pytest.approx(1)


def test_an_unknown_classifier_lists_the_known():
    with pytest.raises(ValueError, match=r"unknown classifier 'nearest'.*choose from") as error:
        classifiers.make("nearest")
    assert all(name in str(error.value) for name in CLASSIFIERS)


def test_an_unknown_keyword_lists_the_known():
    with pytest.raises(ValueError, match=r"unknown nearest_neighbour classifier keyword 'metrics'.*metric"):
        classifiers.make("nearest_neighbour", metrics="hamming")


@pytest.mark.parametrize(
    ("name", "keywords"),
    [
        ("nearest_neighbour", {"metric": "cosine"}),
        ("nearest_neighbour", {"neighbours": 0}),
        ("nearest_neighbour", {"neighbours": 1.5}),
        ("shape_likelihood", {"bandwidth": 0.0}),
        ("shape_likelihood", {"bandwidth": 1e-200}),
        ("shape_likelihood", {"bandwidth": 1e300}),
        ("shape_likelihood", {"bandwidth": -1.0}),
        ("shape_likelihood", {"bandwidth": np.nan}),
        ("aligned_nearest_neighbour", {"rotations": "roll"}),
        ("aligned_nearest_neighbour", {"reach": 1.5}),
        ("aligned_nearest_neighbour", {"bandwidth": 0.0}),
    ],
)
def test_impossible_settings_are_refused(name, keywords):
    with pytest.raises(ValueError, match=f"{next(iter(keywords))}.*{re.escape(str(next(iter(keywords.values()))))}"):
        classifiers.make(name, **keywords)


@pytest.mark.parametrize("metric", ["hamming", "squared"])
def test_the_nearest_neighbour_is_that_of_brute_force(metric):
    maps, labels = _maps(12), [f"class{n % 4}" for n in range(12)]
    model = NearestNeighbour(metric).fit(maps, labels)
    for probe in _maps(30, seed=1):
        if metric == "hamming":
            distance = ((maps > 0.5) != (probe > 0.5)).sum(axis=(1, 2, 3))
        else:
            distance = np.square(maps - probe).sum(axis=(1, 2, 3))
        nearest = {labels[n] for n in np.flatnonzero(distance == distance.min())}
        assert model.predict(probe) in nearest


def test_several_neighbours_vote():
    maps, labels = _maps(9), ["a", "b", "a", "b", "b", "a", "a", "b", "b"]
    model = NearestNeighbour("squared", neighbours=3).fit(maps, labels)
    for probe in _maps(10, seed=1):
        three = np.argsort(np.square(maps - probe).sum(axis=(1, 2, 3)))[:3]
        votes = np.mean([labels[n] == "b" for n in three])
        np.testing.assert_allclose(model.predict_proba(probe), [1 - votes, votes])


@pytest.mark.parametrize("bandwidth", [7.0, 15.0])
def test_the_shape_likelihood_is_bayes_rule(bandwidth):
    """Two variants of one label, one of the other: voxels multiply, variants are averaged, labels are as probable."""
    exemplars = _maps(3)
    model = ShapeLikelihood(bandwidth).fit(exemplars, ["a", "b", "a"])
    for probe in _maps(10, seed=1):
        felt = touch_evidence(probe, 0.03)
        density = [
            np.prod(
                [np.exp(-((p - o) ** 2) / (2 * bandwidth**2)) for o, p in zip(each.ravel(), felt.ravel(), strict=True)]
            )
            for each in touch_evidence(exemplars, 0.03)
        ]
        a, b = (density[0] + density[2]) / 2, density[1]
        np.testing.assert_allclose(model.predict_proba(probe), [a / (a + b), b / (a + b)], rtol=1e-9)


def test_a_map_as_far_from_all_leaves_the_prior():
    touched = np.eye(4, np.prod(SHAPE)).reshape(4, *SHAPE)  # one voxel each
    model = ShapeLikelihood().fit(touched, ["a", "b", "c", "a"])
    np.testing.assert_allclose(model.predict_proba(np.full(SHAPE, 0.5)), [1 / 3, 1 / 3, 1 / 3])


def test_maps_far_from_everything_are_no_trouble():
    model = ShapeLikelihood(bandwidth=1e-3).fit(_maps(2), ["a", "b"])
    p = model.predict_proba(_maps(1, seed=3)[0])
    assert np.isfinite(p).all()
    assert p.sum() == pytest.approx(1)


@pytest.mark.parametrize(
    "estimator",
    [
        LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto"),
        CalibratedClassifierCV(SVC(), cv=2, ensemble=False),
        RandomForestClassifier(20, random_state=0),
    ],
    ids=lambda each: type(each).__name__,
)
def test_any_estimator_with_probabilities_will_do(estimator):
    """It gives what it gives by hand, on p - 0.5, and is itself left as it was."""
    centres, rng = _maps(2), np.random.default_rng(2)
    maps = np.clip(np.repeat(centres, 8, axis=0) + 0.1 * rng.standard_normal((16, *SHAPE)), 0, 1)
    labels = np.repeat(["a", "b"], 8)
    model = ScikitLearn(estimator).fit(maps, labels)
    assert [model.predict(each) for each in centres] == ["a", "b"]
    order = sorted(range(16), key=lambda m: (labels[m], maps[m].tobytes()))
    by_hand = clone(estimator).fit(maps[order].reshape(16, -1) - 0.5, labels[order])
    np.testing.assert_allclose(model.predict_proba(maps[3]), by_hand.predict_proba(maps[3].reshape(1, -1) - 0.5)[0])
    assert not hasattr(estimator, "classes_")


@pytest.mark.parametrize("estimator", [LinearSVC(), "svm", None, RandomForestClassifier])
def test_an_estimator_without_probabilities_is_refused(estimator):
    with pytest.raises(ValueError, match=r"fit and predict_proba, got (LinearSVC\(\)|'svm'|None|<class .*Forest)"):
        ScikitLearn(estimator)


def test_the_hands_grid_is_large_enough_for_every_shape():
    hand = hands.make("two_finger")
    grid = Grid.around(hand.grasp_centre, hand.workspace, 0.004)
    for name in shapes.SHAPES:
        occupancy = shapes.make(name, position=hand.grasp_centre).occupancy(grid)
        assert occupancy.any()
        assert not occupancy[[0, -1]].any()


def test_touch_evidence_is_what_touch_added():
    """Above the prior in log-odds; nothing for what is as likely as before, less likely, or unknown."""
    map = np.array([0.03, 0.001, 0.5, 0.06 / (0.97 + 0.06), 0.9, 1.0])
    expected = [0.0, 0.0, 0.0, np.log(2), np.log(9 * 0.97 / 0.03), np.log(999 * 0.97 / 0.03)]
    np.testing.assert_allclose(touch_evidence(map, 0.03), expected, atol=1e-12)


def test_touched_voxels_name_what_swept_ones_hide():
    """Two maps of a thing whose surroundings were swept differently; by the probabilities the other is nearer."""
    rng = np.random.default_rng(0)
    swept, thing, other = (np.full((10, 10, 10), 0.5) for _ in range(3))
    swept[:, :5] = thing[:, :5] = 0.001
    swept[4:6, 5, 4:6] = other[4:6, 5, 4:6] = np.where(rng.random((2, 2)) < 0.5, 0.3, 0.4)
    thing[4:6, 5, 8] = 0.3
    other[:, 5:, 6:] = 0.001
    exemplars, labels = [thing, other], ["thing", "other"]
    assert NearestNeighbour("touched").fit(exemplars, labels).predict(swept) == "other"
    assert ShapeLikelihood().fit(exemplars, labels).predict(swept) == "other"
    assert NearestNeighbour("squared").fit(exemplars, labels).predict(swept) == "thing"


def test_overlap_asks_what_share_of_the_touched_voxels_two_maps_have_in_common():
    """A map of many touches has most of the other's; by their number alone the nearly empty one is nearer."""
    many, other, few = (np.full((10, 10, 10), 0.5) for _ in range(3))
    many[2:6, 2:6, 2:6], other[8, 8, 8], few[2:4, 2:4, 2:6] = 0.9, 0.9, 0.9
    exemplars, labels = [many, other], ["many", "other"]
    assert NearestNeighbour("overlap").fit(exemplars, labels).predict(few) == "many"
    assert NearestNeighbour("touched").fit(exemplars, labels).predict(few) == "other"
