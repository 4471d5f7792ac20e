"""SceneText: the scene part of a kernel, as plain text. Reading it needs no SymPy."""

from __future__ import annotations

import dataclasses

from vibrokit.symbolic.flow_kind import Flow


@dataclasses.dataclass(frozen=True)
class SceneText:
    """The scene part of a kernel, as text.

    Attributes
    ----------
    flow : Flow
    variables : tuple of str
        Names of the numbers that are integrated.
    parameters : dict of str to int
        Names of the parameters that the right-hand side takes, and their places in `theta`.
    states : int
        How many of the variables are the state q.
    forced : bool
        Whether anything depends on time.
    jumps : bool
        Whether a contact force jumps at first touch.
    breaks : bool
        Whether something that the flow integrates jumps at an event: derivatives, covariances and momenta where a
        contact force does, derivatives of momenta where the derivatives of one do.
    preamble, constants, forcing, derivative, rhs, stops, flight, amplitude, slope : str
        Pieces of the module; empty where the scene has no need of them.
    """

    flow: Flow
    variables: tuple[str, ...]
    parameters: dict[str, int]
    states: int
    forced: bool
    jumps: bool
    breaks: bool
    preamble: str
    constants: str
    forcing: str
    derivative: str
    rhs: str
    stops: str
    flight: str
    amplitude: str
    slope: str
