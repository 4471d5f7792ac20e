"""SceneText: the scene part of a kernel as plain text, so that using it needs no SymPy."""

from __future__ import annotations

import dataclasses

from vibrokit.symbolic.flow_kind import Flow


@dataclasses.dataclass(frozen=True)
class SceneText:
    """The scene part of a kernel as text.

    Attributes
    ----------
    flow : Flow
    variables : tuple of str
        Names of the integrated variables.
    parameters : dict of str to int
        Parameters of the right-hand side by name, with their indices in `theta`.
    states : int
        Number of variables that belong to the state q.
    forced : bool
        Whether the forcing depends on time.
    jumps : bool
        Whether a contact force jumps at first touch.
    breaks : bool
        Whether an integrated variable jumps at an event: derivatives, covariances and momenta jump where a contact
        force does, derivatives of momenta where its derivatives do.
    preamble, constants, forcing, excitations, derivative, rhs, stops, flight, amplitude, slope : str
        Pieces of the module; empty if the scene does not need them.
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
    excitations: str
    derivative: str
    rhs: str
    stops: str
    flight: str
    amplitude: str
    slope: str
