"""The pieces of kernel code, compiled without a stepper so that each can be called."""

from __future__ import annotations

import dataclasses
import inspect
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from vibrokit.kernels.kernel import kernel_for, theta_of
from vibrokit.kernels.stepper import Emitter
from vibrokit.oscillator import Oscillator
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.symbolic.symbols import code_name

if TYPE_CHECKING:
    from vibrokit.symbolic.source import SceneText


@dataclasses.dataclass(frozen=True)
class Pieces(Emitter):
    """Includes every piece of the scene part."""

    name: ClassVar[str] = "pieces"

    def scene_part(self, text: SceneText) -> list[str]:
        pieces = [text.constants, text.forcing, text.derivative, text.rhs, text.stops, text.amplitude, text.slope]
        # Python calls functions that are otherwise only inlined.
        return [piece.replace("(**INLINED)", "(**INLINED_AND_CALLED)") for piece in pieces if piece]


class Compiled:
    """Compiled pieces of one flow of one scene."""

    def __init__(self, scene: Oscillator, flow: Flow) -> None:
        self._module = kernel_for(scene, flow, Pieces()).module
        self.theta = theta_of(scene)
        self.size = self._module.EQUATIONS
        self._named = dict(zip(map(code_name, scene.model.symbols.values()), self.theta, strict=True))

    def has(self, name: str) -> bool:
        """Whether the code of the scene has a piece."""
        return name in vars(self._module)

    def call(self, name: str, *arguments: Any) -> float:
        """Call `law`, `amplitude` or `slope` with the parameters of the scene."""
        return float(getattr(self._module, name)(*arguments, self.theta))

    def forcing(self, time: float) -> tuple[float, ...]:
        """Values of the functions of time that the rates need."""
        if not self.has("forcing"):
            return ()
        values = self._module.forcing(time, self.theta)
        return tuple(map(float, values)) if isinstance(values, tuple) else (float(values),)

    def derivative(self, z: Any, forcing: tuple[float, ...] = ()) -> Any:
        """Rates as computed by steppers that pack lanes, with values of the functions of time; 0 for those left out."""
        function = self._module.derivative
        names = list(inspect.signature(function.py_func).parameters)[self.size :]
        given = iter(forcing)
        rest = [self._named[name] if name in self._named else next(given, 0.0) for name in names]
        return np.array(function(*map(float, z), *map(float, rest)))

    def rhs(self, z: Any, pushing: tuple[bool, ...] = (), time: float = 0.0) -> Any:
        """Rates as computed by steppers that locate contacts."""
        out = np.empty(self.size)
        switches = np.array(pushing, dtype=bool)
        self._module.rhs(time, np.array(z, dtype=float), switches, self.theta, out)
        return out


# Where the rates of the variational Hamiltonian flow hold the force on the mass and its derivatives, by their orders in
# x and v: index, momentum of `hamiltonian_start`, and factor. They are v′, p′ and the lower left of the matrix.
ENTRIES = {
    (0, 0): (1, 0.0, 1),
    (1, 0): (2, 1.0, -1),
    (0, 1): (3, 1.0, -1),
    (2, 0): (13, 1.0, -1),
    (1, 1): (14, 1.0, -1),
    (0, 2): (18, 1.0, -1),
}


def hamiltonian_start(states: tuple[float, ...], momentum: float) -> Any:
    """State, momenta (the last is `momentum`, the others 0), zero action, and the unit matrix.

    There each rate that depends on a part is a single derivative of its force.
    """
    n = len(states)
    momenta = [0.0] * (n - 1) + [momentum]
    return np.concatenate([states, momenta, [0.0], np.eye(2 * n).ravel()])
