"""An exit that the package does not know, written as a user would: leaving a box in (x, v)."""

import math

import numpy as np
import pytest

import vibrokit as vk
from tests.layers import long

pytestmark = pytest.mark.slow

OMEGA, ZETA, FORCE = 1.3, 0.1, 0.2
REST = FORCE / OMEGA**2


class LeaveBox(vk.LeaveRegion):
    """Leaving |x| ≤ x, |v| ≤ v."""

    x: float = math.inf
    v: float = math.inf

    def bounds(self, osc):
        return np.array([[-self.x, self.x], [-self.v, self.v]])


BOXES = [LeaveBox(x=0.5), long(LeaveBox(v=0.5)), long(LeaveBox(x=0.5, v=0.3)), LeaveBox(x=0.3, v=0.6)]


def exact(box):
    """Least Ψ = ½ δqᵀ Σ⁻¹ δq on the faces, with Σ = diag(1/(4ζω³), 1/(4ζω))."""
    return min(2 * ZETA * OMEGA**3 * (box.x - REST) ** 2, 2 * ZETA * OMEGA * box.v**2)


@pytest.fixture(scope="module")
def linear():
    """A linear oscillator under a constant force, and its structure."""
    osc = vk.Oscillator(
        natural_frequency=OMEGA,
        damping_ratio=ZETA,
        excitations=(vk.Constant(force=FORCE),),
        noise=vk.WhiteNoise(intensity=1e-4),
    )
    return osc, vk.find_structure(osc, region=((-1, 1), (-1, 1)), cells=(40, 40), starts=(4, 4), manifolds=False)


@pytest.mark.parametrize("box", BOXES, ids=repr)
def test_action_plot(linear, box):
    osc, structure = linear
    (energy,) = vk.ActionPlot(points=2000, exit=box).run(osc, structure).energies
    assert (energy.source, energy.target) == (0, -1)
    assert energy.value >= exact(box) * (1 - 1e-5)
    assert energy.value - energy.numerical_error <= exact(box)
    # A path is seen at most one test, τ, after it left, and Ψ grows at the rate ½ p₂² = 8ζ²ω²v² ≤ 4ζω Ψ. A path that
    # turns back at a face is seen if it goes (ωτ)²/8 (relative) too far.
    tau = osc.section_interval / box.checks_per_period(osc)
    assert energy.value <= exact(box) * math.exp(4 * ZETA * OMEGA * tau) * (1 + (OMEGA * tau) ** 2 / 8) ** 2
    assert box.is_out(osc, energy.path.q[-1])
    assert not box.is_out(osc, energy.path.q[:-8]).any()


def test_every_face_is_left_by_some_path(linear):
    osc, structure = linear
    result = vk.ActionPlot(points=2000, exit=LeaveBox(v=0.5)).run(osc, structure)
    assert {math.copysign(1, branch.path.q[-1, 1]) for branch in result.branches} == {-1, 1}


@pytest.mark.parametrize("box", BOXES[:2], ids=repr)
def test_action_graph(linear, box):
    osc, structure = linear
    (energy,) = vk.ActionGraph(nodes=(120, 120), exit=box).run(osc, structure).energies
    assert energy.lower <= exact(box) <= energy.upper
    assert energy.value == pytest.approx(exact(box), rel=0.05)


@pytest.mark.parametrize("box", BOXES[2:], ids=repr)
def test_least_action(linear, box):
    osc, structure = linear
    searches = {"shooting": vk.Shooting(points=2000), "graph": vk.GraphSearch(nodes=(80, 80))}
    (energy,) = vk.LeastAction(exit=box, **searches).run(osc, structure).energies
    assert energy.value == pytest.approx(exact(box), rel=1e-9)
    assert energy.lower <= exact(box) * (1 + 1e-9)
    assert energy.certificate.residual < 1e-9


def test_an_attractor_outside_the_box_has_energy_zero(linear):
    osc, structure = linear
    result = vk.ActionPlot(exit=LeaveBox(x=REST / 2)).run(osc, structure)
    assert result.energies[0].value == 0
    assert [finding.code for finding in result.findings] == [vk.Code.AT_EXIT]
