"""What a scene lacks leaves no trace in the code that is generated for it; the driver knows no scene."""

import ast
import re

import pytest

import vibrokit as vk
from tests.scenes import scene
from vibrokit.errors import NoSectionError, SceneError
from vibrokit.kernels.kernel import kernel_for
from vibrokit.symbolic.flow_kind import Flow

NOISY_FLOWS = (Flow.HAMILTONIAN, Flow.HAMILTONIAN_VARIATIONAL, Flow.NOISY, Flow.LINEARISED, Flow.COVARIANCE_REVERSED)
RIGHT = vk.Barrier(vk.Hertz(50.0), 0.5, "right")
LEFT = vk.Barrier(vk.Hertz(40.0), -0.5, "left")


def source(scene, flow=Flow.STATE):
    return kernel_for(scene, flow, vk.RK4()).scene.source


def words(text):
    """Every name in the code; comments and docstrings apart."""
    nodes = list(ast.walk(ast.parse(text)))
    names = {node.id for node in nodes if isinstance(node, ast.Name)}
    names |= {node.arg for node in nodes if isinstance(node, ast.arg)}
    names |= {node.name for node in nodes if isinstance(node, ast.FunctionDef | ast.alias)}
    return names | {node.attr for node in nodes if isinstance(node, ast.Attribute)}


def everything():
    return scene(RIGHT, LEFT, excitations=(vk.Harmonic(0.1, 0.5), vk.Constant(0.1)), noise=vk.WhiteNoise(1e-3))


@pytest.mark.parametrize("flow", list(Flow), ids=lambda flow: flow.value)
def test_the_whole_scene_has_it_all(flow):
    """So that the absences below mean something."""
    found = words(source(everything(), flow))
    assert {"u_k_r", "u_k_l", "u_b_r", "u_b_l", "forcing", "tabulate", "cos", "u_phi"} <= found
    assert ("amplitude" in found) == (flow is Flow.NOISY)
    assert ("p_1" in found) == (flow in (Flow.HAMILTONIAN, Flow.HAMILTONIAN_VARIATIONAL))


@pytest.mark.parametrize("flow", list(Flow), ids=lambda flow: flow.value)
@pytest.mark.parametrize(("stop", "other"), [(RIGHT, "left"), (LEFT, "right")], ids=["right", "left"])
def test_one_side_has_no_trace_of_the_other(flow, stop, other):
    text = source(scene(stop, excitations=(vk.Harmonic(0.1, 0.5),), noise=vk.WhiteNoise(1e-3)), flow)
    assert "barriers.1" not in text
    assert other not in text.replace("LEFT_REGION", "").lower()
    assert not [word for word in words(text) if re.fullmatch(r"C1.*|d1_\d+|touching1|u_[kb]_[rl]", word)]
    assert text.count("sqrt(") <= source(everything(), flow).count("sqrt(")
    assert ("x - u_b" in text) == (stop is RIGHT)
    assert ("u_b - x" in text) == (stop is LEFT)


@pytest.mark.parametrize("flow", list(Flow), ids=lambda flow: flow.value)
def test_no_stops_no_contact_code(flow):
    text = source(scene(excitations=(vk.Harmonic(0.1, 0.5),), noise=vk.WhiteNoise(1e-3)), flow)
    assert "BARRIERS = 0" in text
    assert not [w for w in words(text) if re.match(r"depth|touching|rate$|law|stop$|SIDES|CLAMPED|ROOTED|C\d", w)]
    assert " if " not in functions(text)["derivative"]


@pytest.mark.parametrize("flow", list(Flow), ids=lambda flow: flow.value)
@pytest.mark.parametrize("excitations", [(), (vk.Constant(0.2),)], ids=["nothing", "constant"])
def test_unforced_has_no_time(flow, excitations):
    text = source(scene(RIGHT, excitations=excitations, noise=vk.WhiteNoise(1e-3)), flow)
    assert not words(text) & {"forcing", "tabulate", "table", "cos", "sin", "u_omega", "u_phi", "f", "t", "elapsed"}
    parts = functions(text)
    assert "f" not in arguments(parts["derivative"])
    assert arguments(parts["step_lanes"]) == ["z", "forces", "normals", "theta", "h", "steps"]
    assert "forces[" not in text


@pytest.mark.parametrize("flow", [Flow.STATE, Flow.STATE_VARIATIONAL], ids=lambda flow: flow.value)
@pytest.mark.parametrize("noise", [None, vk.WhiteNoise(1e-3)], ids=["no noise", "noise"])
def test_flows_without_noise_have_no_momenta_and_draw_nothing(flow, noise):
    found = words(source(scene(RIGHT, excitations=(vk.Harmonic(0.1, 0.5),), noise=noise), flow))
    assert not found & {"p_1", "p_2", "S", "amplitude"}


@pytest.mark.parametrize("stepper", [vk.RK4(), vk.Order8(), vk.FreeFlight()], ids=lambda stepper: stepper.name)
def test_one_driver_serves_scenes_and_flows_with_as_many_states(stepper):
    fixed = stepper == vk.RK4()
    jumping = vk.Barrier(vk.CustomLaw("k*depth + c*rate", k=40.0, c=0.1), -0.5, "left")
    scenes = (everything(), scene(RIGHT, LEFT if fixed else jumping, noise=vk.WhiteNoise(1e-3)))
    flows = [flow for flow in Flow if flow is not Flow.NOISY or fixed]
    drivers = {kernel_for(osc, flow, stepper).driver for osc in scenes for flow in flows}
    assert len(drivers) == 1


def test_noiseless_parameters_have_no_intensity():
    assert "noise" not in source(scene(RIGHT))
    assert "noise.intensity" not in scene(RIGHT).parameters


@pytest.mark.parametrize("flow", NOISY_FLOWS, ids=lambda flow: flow.value)
def test_flows_that_need_noise_are_refused_without_it(flow):
    with pytest.raises(SceneError, match=r"it has no noise, so there are no (momenta|random forces) .*WhiteNoise.*\.$"):
        kernel_for(scene(RIGHT), flow, vk.RK4())


def test_additive_noise_has_no_slope_and_state_dependent_noise_has_no_more_than_it_needs():
    assert "slope" not in words(source(everything(), Flow.NOISY))
    of_place = scene(noise=vk.StateDependentNoise(1e-3, "1 + c*x**2", c=0.5))
    assert "slope" not in words(source(of_place, Flow.NOISY))  # Milstein's term needs the slope in v alone
    of_rate = scene(noise=vk.StateDependentNoise(1e-3, "1 + c*v**2", c=0.5))
    assert "slope" in words(source(of_rate, Flow.NOISY))


@pytest.mark.parametrize("flow", list(Flow), ids=lambda flow: flow.value)
def test_generated_modules_read_well(flow):
    kernel = kernel_for(everything(), flow, vk.RK4())
    text = kernel.scene.source
    assert kernel.driver.source.startswith('"""')
    tree = ast.parse(text)
    imports = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
    imported = [alias.asname or alias.name for node in imports for alias in node.names]
    used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    assert len(imported) == len(set(imported))
    assert set(imported) <= used
    assert "theta[3] = barriers.0.law.stiffness (u_k_r)" in ast.get_docstring(tree)
    assert not re.search(
        r"\*\*|\bpow\(|select\(|Heaviside|DiracDelta|\n{4}",
        text.split('"""')[2].replace("@njit(**", ""),
    )


def test_no_number_is_baked_in():
    """Two scenes that differ in numbers only share their code to the letter."""
    other = everything().replace({path: 1.23 * value for path, value in everything().parameters.items()})
    for flow in Flow:
        assert kernel_for(everything(), flow, vk.RK4()) == kernel_for(other, flow, vk.RK4())
        assert "0.57" not in functions(source(other, flow))["derivative"]


class TestAperiodic:
    """Excitations without a common period: legal, but without a section."""

    osc = scene(RIGHT, excitations=(vk.Harmonic(0.1, 1.0), vk.Harmonic(0.1, 2**0.5)))

    def test_the_equations_hold_both(self):
        assert {"u_omega_0", "u_omega_1"} <= words(source(self.osc))
        assert str(self.osc.model).count("cos(") == 2

    def test_the_trajectory_runs_by_duration(self):
        path = self.osc.trajectory((0.1, 0.0), duration=20.0)
        assert path.t[-1] == pytest.approx(20.0, rel=1e-15)
        slow = self.osc.trajectory((0.1, 0.0), duration=20.0, stepper=vk.RK4(steps=4096))
        assert abs(path.states[-1] - slow.states[-1]).max() < 1e-4

    def test_whoever_needs_the_section_says_so(self):
        with pytest.raises(NoSectionError, match=r"have no common period, so there is no section; .*\.$"):
            self.osc.section_map([[0.1, 0.0]])
        with pytest.raises(NoSectionError, match="no section"):
            self.osc.trajectory((0.1, 0.0), periods=1)


def functions(text):
    return {node.name: ast.unparse(node) for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)}


def arguments(text):
    return [argument.arg for argument in ast.parse(text).body[0].args.args]
