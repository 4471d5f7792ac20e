"""Noise: the random force."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar, Self

from vibrokit.construction import called
from vibrokit.parts.formula_part import FormulaPart
from vibrokit.parts.parameter import parameter
from vibrokit.parts.part import Part
from vibrokit.parts.spectral_density import Measured, intensity_of

if TYPE_CHECKING:
    from vibrokit.measured.noise_fit import NoiseEstimate


class NoiseModel(Part):
    """Random force of intensity D, in the Itô sense. Abstract.

    White noise drives the velocity: dv = … dt + amplitude(x, v) √D dW. A model with extra states (coloured noise)
    names them in `extra_states`, as it likes; then the white noise drives the last of these, `drift` gives their rates
    without noise, and `force` gives their force on the mass.

    For developers
    --------------
    `amplitude` alone is a complete model. With `extra_states`, write `force` and `drift` as well. None of them may jump
    in a state; the derivation of the equations refuses that.
    """

    variables: ClassVar[tuple[str, ...]] = ("x", "v")
    extra_states: ClassVar[tuple[str, ...]] = ()

    intensity: float = parameter("D", "m^2 s^-3", minimum=0)

    @abstractmethod
    def amplitude(self, x: Any, v: Any) -> Any:
        """Factor of √D dW, as a SymPy expression in displacement and velocity."""

    def formulas(self, argument: Callable[[str], Any]) -> tuple[Any, ...]:
        """Return the amplitude, and the force and the rates of the extra states."""
        plane, extra = map(argument, self.variables), tuple(map(argument, self.extra_states))
        x, v = plane
        return (self.amplitude(x, v), self.force(*extra), *self.drift(x, v, *extra))

    def force(self, *extra: Any) -> Any:
        """Force of the extra states on the mass (m s⁻²)."""
        return 0

    def drift(self, x: Any, v: Any, *extra: Any) -> tuple[Any, ...]:
        """Rates of the extra states without noise, one per state."""
        return ()


class StationaryNoise(NoiseModel):
    """Noise whose force has a power spectral density, the same wherever the mass is. Abstract."""

    @abstractmethod
    def density(self, frequency: Any) -> Any:
        """One-sided power spectral density of the force per unit mass, in (m/s²)²/Hz, at an angular frequency (s⁻¹).

        By arithmetic alone, so that it may be asked for an array of frequencies.
        """

    @classmethod
    @called
    def from_record(cls, t: Any, a: Any) -> NoiseEstimate:
        """Estimate the noise from a record of its force per unit mass, or of the acceleration of the support.

        The model's density is fitted to Welch's estimate of the record's, up to 0.3 of the Nyquist frequency.

        Parameters
        ----------
        t : array_like (count,)
            Times (s), equally spaced, 512 or more.
        a : array_like (count,)
            The acceleration (m s⁻²); a force is divided by the mass first.

        Returns
        -------
        NoiseEstimate
            Its `noise`, `standard_errors` and `plot`.

        Raises
        ------
        ParameterError
            The record is too short, not finite or not equally spaced, or does not determine the parameters.
        """
        from vibrokit.measured.noise_fit import fitted_noise

        return fitted_noise(cls, t, a)

    def unresolved(self, resolution: float) -> str:
        """Return why noise fitted to a spectrum of this resolution (s⁻¹) is none that the record shows; "" if it is."""
        return ""


class WhiteNoise(StationaryNoise):
    """Gaussian white noise ξ on the velocity, ⟨ξ(t) ξ(t+τ)⟩ = D δ(τ).

    Parameters
    ----------
    intensity : float
        D, in m² s⁻³, not negative.
    """

    def amplitude(self, x: Any, v: Any) -> Any:
        """Factor before √D dW: 1 everywhere."""
        return 1

    @classmethod
    @called
    def from_psd(cls, level: float, of: Measured | str = Measured.ACCELERATION, *, mass: float | None = None) -> Self:
        """Return the noise of a one-sided power spectral density S, as analyzers of spectra show it.

        Parameters
        ----------
        level : float
            S at the frequencies of the motion: in (m/s²)²/Hz, or in N²/Hz of a force; not negative.
        of : {"acceleration", "force", "base acceleration"}
            What S was measured of: the random force per unit mass, the force, or the support.
        mass : float, optional
            The mass (kg) that a force acts on.

        Raises
        ------
        ParameterError

        Examples
        --------
        >>> WhiteNoise.from_psd(0.5)
        WhiteNoise(intensity=0.25)
        >>> WhiteNoise.from_psd(0.5, of="force", mass=0.5)
        WhiteNoise(intensity=1.0)
        """
        return cls(intensity_of(f"{cls.__name__}.from_psd", level, of, mass))

    @property
    def psd(self) -> float:
        """One-sided power spectral density 2D of the force per unit mass, in (m/s²)²/Hz."""
        self.check_settled("WhiteNoise.psd")
        return 2 * self.intensity

    def density(self, frequency: Any) -> Any:
        """One-sided density 2D, the same at all frequencies."""
        return self.psd + 0 * frequency


class StateDependentNoise(FormulaPart, NoiseModel):
    """Itô white noise on the velocity, √D g(x, v) dW, with g given as a formula in ``x`` and ``v``.

    Parameters
    ----------
    intensity : float
        D, in m² s⁻³, not negative.
    amplitude : str
        Formula of g; it is never run as code.
    **constants : float
        Values of the other names in the formula.

    Examples
    --------
    >>> StateDependentNoise(1e-4, "1 + c*x**2", c=0.5)
    StateDependentNoise(intensity=0.0001, amplitude='1 + c*x**2', c=0.5)
    """

    formula_name: ClassVar[str] = "amplitude"

    formula: str
    constants: tuple[tuple[str, Any], ...]

    def __init__(self, /, intensity: float, amplitude: str, **constants: float) -> None:
        (declared,) = self._own()
        object.__setattr__(self, "intensity", declared.checked(type(self).__name__, intensity))
        self._read(amplitude, constants)

    def amplitude(self, x: Any, v: Any) -> Any:
        """Factor of √D dW: the formula."""
        return self._evaluate(x, v)
