"""The code that kernels are made of, compiled without a stepper round it, so that each piece can be called."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from typing import Any, ClassVar, Self

import numpy as np

from vibrokit.errors import VibrokitError
from vibrokit.kernels.kernel import kernel_for, theta_of
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.symbolic.scene_text import SceneText
from vibrokit.testing.report import ConformanceError


@dataclasses.dataclass(frozen=True)
class _Pieces(Stepper):
    """Takes every piece of the scene part, and no step."""

    name: ClassVar[str] = "pieces"
    templates: ClassVar[tuple[str, ...]] = ()

    def settings(self, scene: Any, interval: float) -> tuple[float, ...]:
        return ()

    def scene_part(self, text: SceneText) -> list[str]:
        pieces = [text.constants, text.forcing, text.derivative, text.rhs, text.stops, text.amplitude, text.slope]
        return [piece for piece in pieces if piece]

    def refined(self) -> Self:
        return self

    def coarsened(self) -> Self:
        return self


class Compiled:
    """Compiled pieces of one flow of one scene.

    Parameters
    ----------
    scene : Oscillator
    flow : Flow
    """

    def __init__(self, scene: Oscillator, flow: Flow) -> None:
        self._module = _guarded(lambda: kernel_for(scene, flow, _Pieces()).module)
        self.theta = theta_of(scene)
        self.size = self._module.EQUATIONS
        self._named = dict(zip(map(str, scene.model.symbols.values()), self.theta, strict=True))

    def offers(self, name: str) -> bool:
        """Whether the scene has need of a piece."""
        return name in vars(self._module)

    def call(self, name: str, *arguments: Any) -> float:
        """Call `forcing`, `law`, `amplitude` or `slope`; theta is given to it."""
        return _guarded(lambda: float(getattr(self._module, name)(*arguments, self.theta)))

    def derivative(self, z: Any, forcing: float = 0.0) -> Any:
        """Rates as steppers that pack lanes compute them."""
        function = self._module.derivative
        names = list(inspect.signature(function.py_func).parameters)[self.size :]
        rest = [forcing if name == "f" and name not in self._named else self._named[name] for name in names]
        return _guarded(lambda: np.array(function(*map(float, z), *map(float, rest))))

    def rhs(self, z: Any, pushing: tuple[bool, ...] = (), time: float = 0.0) -> Any:
        """Rates as steppers that locate contacts compute them."""
        out = np.empty(self.size)
        switches = np.array(pushing, dtype=bool)
        _guarded(lambda: self._module.rhs(time, np.array(z, dtype=float), switches, self.theta, out))
        return out


# Where, in the rates of the Hamiltonian flow with its variations that start so, a force's derivatives of some orders
# in x and v stand alone: p′, and the lower left of the matrix.
ENTRIES = {(1, 0): 2, (0, 1): 3, (2, 0): 13, (1, 1): 14, (0, 2): 18}


def hamiltonian_start(states: tuple[float, ...], momentum: float) -> Any:
    """State, momenta (the last is `momentum`, the others 0), no action, and the unit matrix.

    At such a point every rate that a part enters is one derivative of it, alone.
    """
    n = len(states)
    momenta = [0.0] * (n - 1) + [momentum]
    return np.concatenate([states, momenta, [0.0], np.eye(2 * n).ravel()])


def _guarded(work: Callable[[], Any]) -> Any:
    try:
        return work()
    except VibrokitError:
        raise
    except Exception as error:
        lines = [line for line in str(error).splitlines() if line and not line.startswith("Failed in")]
        reason = lines[0] if lines else ""
        raise ConformanceError(
            f"The formula does not compile ({type(error).__name__}: {reason}); use arithmetic and the functions of "
            "vibrokit.parts.functions only."
        ) from error
