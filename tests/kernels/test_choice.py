"""Which stepper a scene gets, and the warning for too few steps."""

import math
import subprocess
import sys
import warnings

import pytest

import vibrokit as vk
from vibrokit.kernels.choice import CoarseStepsWarning, ensemble_stepper, single_stepper
from vibrokit.kernels.named import name_of, named_stepper
from vibrokit.kernels.time_scales import contact_times
from vibrokit.scene_file import load_scene
from vibrokit.symbolic.flow_kind import Flow

SMOOTH = [Flow.STATE, Flow.STATE_VARIATIONAL, Flow.HAMILTONIAN]


def one_stop(law, **parts):
    parts = {"excitations": (vk.Harmonic(0.2, 0.8),), "noise": vk.WhiteNoise(1e-4), **parts}
    return vk.Oscillator(natural_frequency=1.0, damping_ratio=0.02, barriers=(vk.Barrier(law, 0.3, "right"),), **parts)


@pytest.mark.parametrize("name", ["hertz-0.570", "hertz-0.525"])
def test_the_scenes_of_the_paper(name):
    scene = load_scene(name)
    for flow in (Flow.STATE, Flow.HAMILTONIAN, Flow.NOISY):
        assert ensemble_stepper(scene, flow) == vk.RK4(256)
    for flow in SMOOTH:
        assert isinstance(single_stepper(scene, flow), vk.FreeFlight)
    assert single_stepper(scene, Flow.NOISY) == vk.RK4(256)


@pytest.mark.parametrize("name", ["duffing", "double-well"])
def test_no_stops_and_no_linear_spring(name):
    scene = load_scene(name)
    assert ensemble_stepper(scene, Flow.STATE) == vk.RK4(256)
    assert isinstance(single_stepper(scene, Flow.STATE), vk.Order8)


@pytest.mark.parametrize("stiffness", [400.0, 1e4])
def test_duration_of_a_linear_contact(stiffness):
    """Half a period of the spring and the stop together."""
    (contact,) = contact_times(one_stop(vk.Linear(stiffness)), Flow.STATE)
    assert contact.duration == pytest.approx(math.pi / math.sqrt(1 + stiffness), rel=0.1)
    assert contact.exponent == pytest.approx(1.0)


def test_more_steps_for_stiffer_stops():
    """RK4(256) takes five steps in each contact of the second, and there found a steady state that is none."""
    assert ensemble_stepper(one_stop(vk.Linear(100.0)), Flow.STATE) == vk.RK4(1024)
    assert isinstance(ensemble_stepper(one_stop(vk.Linear(400.0)), Flow.STATE), vk.Order8)
    duffing = one_stop(vk.Linear(1e8), spring=vk.CubicSpring(1.0, 0.3))
    assert isinstance(ensemble_stepper(duffing, Flow.STATE), vk.Order8)
    assert ensemble_stepper(one_stop(vk.Linear(1e8)), Flow.NOISY).steps >= 65536


def test_default_follows_contacts_that_rk4_256_does_not():
    scene = one_stop(vk.Linear(400.0))
    start = [[0.1 * i, 0.0] for i in range(-5, 3)]
    default, exact = (scene.section_map(start, 2, stepper=s) for s in (None, vk.FreeFlight(1e-12)))
    assert abs(default - exact).max() < 1e-3


def test_long_sections_get_more_steps():
    slow = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, excitations=(vk.Harmonic(0.1, 0.01),))
    assert ensemble_stepper(slow, Flow.STATE) == vk.RK4(8192)


def test_force_that_jumps():
    scene = one_stop(vk.CustomLaw("k*depth + c*rate", k=50.0, c=0.3))
    assert isinstance(ensemble_stepper(scene, Flow.STATE), vk.Order8)
    assert isinstance(ensemble_stepper(scene, Flow.STATE_VARIATIONAL), vk.Order8)


@pytest.mark.parametrize("law", [vk.Hertz(0.0), vk.Hertz(1e40), vk.CustomLaw("exp(a*depth) - 1", a=5000.0)])
def test_odd_laws_are_survived(law):
    for unforced in ({}, {"excitations": ()}):
        ensemble_stepper(one_stop(law, **unforced), Flow.STATE)


def test_zero_gap_at_resonance_without_damping():
    scene = vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.0,
        barriers=(vk.Barrier(vk.Hertz(50.0), 0.0, "right"),),
        excitations=(vk.Harmonic(0.1, 1.0),),
    )
    assert ensemble_stepper(scene, Flow.STATE) == vk.RK4(256)


def test_warning_for_too_few_steps():
    with pytest.warns(CoarseStepsWarning, match=r"RK4\(steps=2048\), or FreeFlight") as caught:
        one_stop(vk.Linear(400.0)).section_map([[0.0, 0.0]], stepper=vk.RK4(256))
    assert caught[0].filename == __file__


def test_no_warning_for_what_is_chosen_by_default():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for osc in (one_stop(vk.Linear(400.0)), one_stop(vk.Linear(1e8)), load_scene("hertz-0.570")):
            osc.section_map([[0.0, 0.0]])
            osc.trajectory([0.0, 0.0], 1)


def test_noise_with_stops_too_stiff_for_any_step_warns():
    with pytest.warns(CoarseStepsWarning, match="it needs some"):
        one_stop(vk.Linear(1e12)).section_map([[0.0, 0.0]], rng=0)


@pytest.mark.slow
def test_second_process_needs_no_sympy():
    lines = [
        "import sys",
        "from vibrokit.scene_file import load_scene",
        "load_scene('hertz-0.570').section_map([[0.0, 0.0]])",
        "load_scene('duffing').trajectory([0.0, 0.0], 1)",
        "print('sympy' in sys.modules)",
    ]
    command = [sys.executable, "-c", "\n".join(lines)]
    for _ in range(2):
        run = subprocess.run(command, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"


@pytest.mark.parametrize(
    "stepper", [vk.RK4(512), vk.Order8(1e-9), vk.FreeFlight(1e-12), vk.FreeFlight(3e-15)], ids=repr
)
def test_a_stepper_has_a_name_that_it_is_read_from(stepper):
    assert named_stepper(name_of(stepper)) == stepper
