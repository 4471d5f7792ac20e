"""What an analyzer of a plug-in returns is checked at once, in terms that its author can use."""

import dataclasses
import math

import numpy as np
import pytest

import vibrokit as vk
from vibrokit.results.codes import Code

OSC = vk.load_scene("double-well")
SOUND = vk.ActivationEnergy(0, 1, 0.05, 0.04, 0.06, "given", vk.Bound.ESTIMATE)


@pytest.fixture(scope="module")
def structure():
    """Attractor 0 at x = −1, attractor 1 at x = 1."""
    return vk.find_structure(OSC, cells=(20, 20), starts=(8, 8), manifolds=False)


class Given(vk.Analyzer):
    """Returns what it is given."""

    found: object = None

    def analyze(self, problem):
        return self.found


def returned(structure, **changes):
    """The result of an analyzer that returns a sound energy with some changes."""
    energy = dataclasses.replace(SOUND, **changes)
    return Given(source=0, found=vk.Analysis((energy,))).run(OSC, structure)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"target": np.int64(1)},
        {"target": -1},
        {"value": 0.0, "lower": 0.0},
        {"lower": 0.05, "upper": 0.05},
        {"lower": 0.0, "upper": math.inf},
    ],
    ids=str,
)
def test_sound_energies_are_taken(structure, changes):
    (energy,) = returned(structure, **changes).energies
    assert all(getattr(energy, name) == value for name, value in changes.items())


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"target": 2}, r"target 2; .* 0 to 1, or -1"),
        ({"target": -4}, r"target -4; .* 0 to 1, or -1"),
        ({"target": "right-rest"}, r"target 'right-rest'; .* 0 to 1, or -1"),
        ({"target": 0.5}, r"target 0\.5; .* 0 to 1, or -1"),
        ({"target": None}, r"target None; .* 0 to 1, or -1"),
        ({"source": 1}, r"source 1; it must be 0"),
        ({"value": math.nan}, r"energy nan; it must be 0 or positive"),
        ({"value": -1e-3}, r"energy -0\.001; it must be 0 or positive"),
        ({"lower": 0.0501}, r"bounds 0\.0501 to 0\.06, .* energy 0\.05; .* 0 and inf"),
        ({"upper": 0.0499}, r"bounds 0\.04 to 0\.0499, .* energy 0\.05; .* 0 and inf"),
        ({"lower": math.nan}, r"bounds nan to 0\.06, .* energy 0\.05; .* 0 and inf"),
    ],
    ids=str,
)
def test_other_energies_are_refused(structure, changes, words):
    with pytest.raises(ValueError, match=rf"^Given\.analyze returned the {words}.*\.$"):
        returned(structure, **changes)


@pytest.mark.parametrize("lost", [0, 1])
def test_an_attractor_in_a_cell_of_another_basin_is_refused(structure, lost):
    """Leaving its basin could not be told from staying."""
    labels = np.where(structure.basins.labels >= 0, 1 - lost, structure.basins.labels)
    basins = dataclasses.replace(structure.basins, labels=labels.astype(np.int16))
    wrong = dataclasses.replace(structure, basins=basins)
    energies = [dataclasses.replace(SOUND, source=source, target=1 - source) for source in (0, 1)]
    results = [Given(source=source, found=vk.Analysis((energies[source],))).run(OSC, wrong) for source in (0, 1)]
    assert [len(result.energies) for result in results] == [int(source != lost) for source in (0, 1)]
    (finding,) = results[lost].found(Code.SOURCE_FAILED)
    assert finding.source == lost


def test_branches_are_checked_too(structure):
    wrong = dataclasses.replace(SOUND, target=7)
    with pytest.raises(ValueError, match=r"Given\.analyze returned the target 7"):
        Given(source=0, found=vk.Analysis((SOUND,), branches=(SOUND, wrong))).run(OSC, structure)


@pytest.mark.parametrize("found", [None, 0.05, SOUND, (SOUND,)], ids=lambda found: type(found).__name__)
def test_what_is_no_analysis(structure, found):
    with pytest.raises(TypeError, match=r"Given\.analyze must return an Analysis, got "):
        Given(source=0, found=found).run(OSC, structure)


def test_what_is_no_energy(structure):
    with pytest.raises(TypeError, match=r"Given\.analyze must return an ActivationEnergy for each exit, got 0\.05\."):
        Given(source=0, found=vk.Analysis((0.05,))).run(OSC, structure)
