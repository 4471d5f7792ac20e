import dataclasses
import math

import pytest

import vibrokit as vk
from vibrokit.comparison.sensitivities import sensitivities, sensitivities_text
from vibrokit.errors import StructureError
from vibrokit.results.energy import ActivationEnergy, Bound

PARAMETERS = {"a": 2.0, "b": -0.5, "c": 0.0, "noise.intensity": 0.1}


def power_law():
    """ΔU = a³ b⁴, whose powers are its sensitivities in per cent."""
    value = 2.0**3 * 0.5**4
    slopes = {"a": 3 * value / 2.0, "b": 4 * value / -0.5, "c": 1.0, "noise.intensity": 0.0}
    return ActivationEnergy(
        0, 1, value, value, value, "exact", Bound.EXACT, sensitivity=slopes,
        sensitivity_error={"a": 0.02 * value / 2.0, "b": 0.01 * value / 0.5, "c": 0.0, "noise.intensity": 0.0},
    )  # fmt: skip


def test_powers_are_per_cents_and_the_mean_time_follows():
    energy = power_law()
    found = {one.parameter: one for one in sensitivities(energy, PARAMETERS, 0.1, tied={"both": ("a", "b")})}
    assert [*found] == ["both", "b", "a", "noise.intensity"]  # no effect of c, which is 0
    assert [found[name].energy for name in ("both", "b", "a")] == pytest.approx([7, 4, 3])
    assert [found[name].energy_error for name in ("both", "b", "a")] == pytest.approx([0.03, 0.01, 0.02])
    depth = energy.value / 0.1
    assert found["a"].time == pytest.approx(100 * math.expm1(0.03 * depth))
    assert found["noise.intensity"].time == pytest.approx(100 * math.expm1(depth / 1.01 - depth))
    assert "nan" not in sensitivities_text(tuple(found.values()))
    assert all(math.isnan(one.time) for one in sensitivities(energy, PARAMETERS))


def test_parameters_that_parts_share_count_together():
    """ΔU = (gap of both stops)⁶ / (stiffness of both); mirrored stops have positions of both signs."""
    numbers = {
        "barriers.0.position": 0.5, "barriers.1.position": -0.5, "barriers.0.law.stiffness": 4.0,
        "barriers.1.law.stiffness": 4.0, "excitations.0.frequency": 1.0, "excitations.1.frequency": 2.0,
    }  # fmt: skip
    value = 0.5**6 / 4.0
    slopes = {
        name: power * value / numbers[name] for name, power in zip(numbers, (3, 3, -0.5, -0.5, 1, 1), strict=True)
    }
    energy = dataclasses.replace(power_law(), value=value, lower=value, upper=value, sensitivity=slopes,
                                 sensitivity_error=dict.fromkeys(slopes, 0.0))  # fmt: skip
    found = {one.parameter: one.energy for one in sensitivities(energy, numbers)}
    assert found["barriers.*.position"] == pytest.approx(6.0)
    assert found["barriers.*.law.stiffness"] == pytest.approx(-1.0)
    assert "excitations.*.frequency" not in found  # they differ
    named = {one.parameter for one in sensitivities(energy, numbers, tied={"gaps": PAIR})}
    assert "gaps" in named
    assert "barriers.*.position" not in named


def test_what_has_no_sensitivities_is_refused():
    with pytest.raises(StructureError):
        sensitivities(dataclasses.replace(power_law(), sensitivity={}), PARAMETERS)
    with pytest.raises(StructureError, match="nearest is 'a'"):
        sensitivities(power_law(), PARAMETERS, tied={"x": ("aa",)})


PAIR = ("barriers.0.position", "barriers.1.position")


def least(osc, source, points=2000):
    structure = vk.find_structure(osc, cells=(60, 60), starts=(8, 8), manifolds=False)
    quick = vk.LeastAction(source=source, graph=None, shooting=vk.Shooting(points=points, rounds=6))
    return min(quick.run(osc, structure).energies, key=lambda energy: energy.value)


def scaled(osc, names, factor):
    return osc.replace({name: factor * osc.parameters[name] for name in names})


@pytest.mark.long
def test_both_gaps_of_the_paper():
    """The stops moved by 0.1 % to either side, and the energies solved for anew: at 1 % the power is 0.6 % off."""
    osc = vk.load_scene("hertz-0.570")
    energy = least(osc, "clear")
    found = {one.parameter: one for one in sensitivities(energy, osc.parameters, tied={"gaps": PAIR})}
    moved = [least(scaled(osc, PAIR, factor), "clear").value for factor in (1.001, 0.999)]
    assert found["gaps"].energy == pytest.approx(math.log(moved[0] / moved[1]) / math.log(1.001 / 0.999), rel=5e-4)


@pytest.mark.long
def test_gaps_of_a_heat_exchanger_tube():
    """ΔU goes like gap^5.9. It also goes like the square of a length by which gaps and forces are scaled together."""
    stops = [vk.Barrier(vk.Linear(2e6 / 0.35), sign * 2.5e-4, side) for sign, side in ((1, "right"), (-1, "left"))]
    osc = vk.Oscillator(
        natural_frequency=math.sqrt(22e3 / 0.35), damping_ratio=0.008, barriers=stops,
        excitations=(vk.Harmonic(6 / 0.35, 2 * math.pi * 65),), noise=vk.WhiteNoise(1e-3 / 0.35**2 / 2),
    )  # fmt: skip
    energy = least(osc, "clear")
    assert energy.value == pytest.approx(2.1725e-3, rel=1e-4)
    tied = {"gaps": PAIR, "lengths": (*PAIR, "excitations.0.amplitude")}
    found = {one.parameter: one for one in sensitivities(energy, osc.parameters, osc.noise.intensity, tied=tied)}
    assert found["lengths"].energy == pytest.approx(2.0, abs=2 * found["lengths"].energy_error)
    assert found["lengths"].energy_error < 0.02
    moved = [least(scaled(osc, PAIR, factor), "clear").value for factor in (1.02, 0.98)]
    power = math.log(moved[0] / moved[1]) / math.log(1.02 / 0.98)
    assert power == pytest.approx(5.9, abs=0.05)
    assert found["gaps"].energy == pytest.approx(power, abs=0.02 + found["gaps"].energy_error)
