"""The vector field of a scene, its Jacobian and Hamilton's vector field, compiled from the formulas of the parts."""

from __future__ import annotations

import dataclasses
import types
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.kernel import first_call, kernel_for, theta_of
from vibrokit.kernels.stepper import Emitter
from vibrokit.parts.scene import Scene
from vibrokit.progress import current
from vibrokit.symbolic.flow_kind import Flow

if TYPE_CHECKING:
    from vibrokit.symbolic.source import SceneText

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class _Rates(Emitter):
    """Emits the right-hand side of a flow alone."""

    name: ClassVar[str] = "rates"

    def scene_part(self, text: SceneText) -> list[str]:
        """The right-hand side, the loop over states, and the force of each excitation."""
        return [text.constants, text.forcing, text.excitations, text.derivative, _rates_function(text)]


def _rates_function(text: SceneText) -> str:
    """Function `rates(t, z, theta, out)`: the right-hand sides of states z (count, EQUATIONS) at times t (count,)."""
    places = range(len(text.variables))
    values = [*(f"z[lane, {place}]" for place in places), *text.functions, *text.parameters]
    lines = ["@njit(**OPTIONS)", "def rates(t, z, theta, out):"]
    lines += [f"    {name} = theta[{place}]" for name, place in text.parameters.items()]
    lines += ["    for lane in range(z.shape[0]):"]
    lines += [f"        {', '.join(text.functions)} = forcing(t[lane], theta)"] * text.forced
    lines += [f"        {', '.join(f'out[lane, {place}]' for place in places)} = derivative({', '.join(values)})"]
    return "\n".join([*lines, ""])


class VectorField:
    """The exact right-hand sides of a scene's equations, b(q, t) = q′ without noise.

    The force of a stop is that at positive depth. At depth 0 and below a stop does not push, so the Jacobian there is
    that of the free motion.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._theta = theta_of(scene)
        self._modules: dict[Flow, types.ModuleType] = {}

    def rate(self, states: Array, time: float | Array = 0.0) -> Array:
        """Return b(q, t), shape (…, n), at states of shape (…, n) and one time (s), or a time for each."""
        return self._variational(states, time)[..., : np.shape(states)[-1]]

    def jacobian(self, states: Array, time: float | Array = 0.0) -> Array:
        """Return ∂b/∂q, shape (…, n, n), at states of shape (…, n)."""
        size = np.shape(states)[-1]
        return self._variational(states, time)[..., size:].reshape(*np.shape(states), size)

    def hamiltonian_rate(self, states: Array, momenta: Array, time: float | Array = 0.0) -> Array:
        """Return (q′, p′) of Hamilton's equations, shape (…, 2n), at states and momenta of shape (…, n).

        Raises SceneError for a scene without noise, which has no momenta.
        """
        points = np.concatenate([states, momenta, np.zeros((*np.shape(states)[:-1], 1))], axis=-1)
        return self._rates(Flow.HAMILTONIAN, points, time)[..., :-1]

    def excitation(self, index: int, time: float, place: tuple[float, float] = (0.0, 0.0)) -> float:
        """Return the force of one excitation (m s⁻²) at a place (x, v), on which most do not depend."""
        state = place if self.scene.depends_on_state else ()
        return float(self._module(Flow.STATE_VARIATIONAL).excitation(index, time, *state, self._theta))

    def _variational(self, states: Array, time: float | Array) -> Array:
        """b, and ∂b/∂q row by row: the rates of the variational equations where the matrix is the identity."""
        shape = np.shape(states)
        identity = np.broadcast_to(np.eye(shape[-1]).ravel(), (*shape[:-1], shape[-1] ** 2))
        return self._rates(Flow.STATE_VARIATIONAL, np.concatenate([states, identity], axis=-1), time)

    def _rates(self, flow: Flow, variables: Array, time: float | Array) -> Array:
        flat = np.ascontiguousarray(variables.reshape(-1, variables.shape[-1]))
        times = np.broadcast_to(time, variables.shape[:-1]).astype(float).ravel()
        out = np.empty_like(flat)
        rates = self._module(flow).rates
        current().check()  # for all that calls it again and again, such as searches for roots and SciPy's solvers
        with first_call(rates):
            rates(times, flat, self._theta, out)
        return out.reshape(variables.shape)

    def _module(self, flow: Flow) -> types.ModuleType:
        if flow not in self._modules:
            self._modules[flow] = kernel_for(self.scene, flow, _Rates()).module
        return self._modules[flow]
