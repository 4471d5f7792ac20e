"""Stochastic stability of vibro-impact oscillators.

The public names below are loaded on first use, so that importing vibrokit is fast.
"""

import re
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vibrokit.analyzers.action_graph import ActionGraph as ActionGraph
    from vibrokit.analyzers.action_plot import ActionPlot as ActionPlot
    from vibrokit.analyzers.analyzer import Analysis as Analysis
    from vibrokit.analyzers.analyzer import Analyzer as Analyzer
    from vibrokit.analyzers.energy_continuation import energy_continuation as energy_continuation
    from vibrokit.analyzers.evolution import evolve_density as evolve_density
    from vibrokit.analyzers.exits import Exit as Exit
    from vibrokit.analyzers.exits import FirstContact as FirstContact
    from vibrokit.analyzers.exits import LeaveBasin as LeaveBasin
    from vibrokit.analyzers.exits import LeaveBounds as LeaveBounds
    from vibrokit.analyzers.exits import LeaveRegion as LeaveRegion
    from vibrokit.analyzers.graph.search import GraphSearch as GraphSearch
    from vibrokit.analyzers.least_action import LeastAction as LeastAction
    from vibrokit.analyzers.mean_exit_times import MFET as MFET
    from vibrokit.analyzers.problem import ExitProblem as ExitProblem
    from vibrokit.analyzers.sgcm_wkb import SGCM as SGCM
    from vibrokit.analyzers.shooting.shooting import Shooting as Shooting
    from vibrokit.assessment.assess import assess as assess
    from vibrokit.assessment.assessment import Assessment as Assessment
    from vibrokit.assessment.plausibility import plausibility as plausibility
    from vibrokit.assessment.sweep import sweep as sweep
    from vibrokit.comparison.occupancies import occupancies as occupancies
    from vibrokit.comparison.reconcile import reconcile as reconcile
    from vibrokit.comparison.reconciliation import Reconciliation as Reconciliation
    from vibrokit.comparison.stationary import StationaryDensity as StationaryDensity
    from vibrokit.comparison.transitions import Transitions as Transitions
    from vibrokit.kernels.fixed_steps import RK4 as RK4
    from vibrokit.kernels.fixed_steps import RK8 as RK8
    from vibrokit.kernels.located import FreeFlight as FreeFlight
    from vibrokit.kernels.located import Order8 as Order8
    from vibrokit.oscillator import Oscillator as Oscillator
    from vibrokit.parts.barrier import Barrier as Barrier
    from vibrokit.parts.contact import ContactLaw as ContactLaw
    from vibrokit.parts.contact import CustomLaw as CustomLaw
    from vibrokit.parts.contact import Hertz as Hertz
    from vibrokit.parts.contact import Linear as Linear
    from vibrokit.parts.excitation import Constant as Constant
    from vibrokit.parts.excitation import Excitation as Excitation
    from vibrokit.parts.excitation import Harmonic as Harmonic
    from vibrokit.parts.noise import NoiseModel as NoiseModel
    from vibrokit.parts.noise import StateDependentNoise as StateDependentNoise
    from vibrokit.parts.noise import WhiteNoise as WhiteNoise
    from vibrokit.parts.parameter import parameter as parameter
    from vibrokit.parts.spring import CubicSpring as CubicSpring
    from vibrokit.parts.spring import CustomSpring as CustomSpring
    from vibrokit.parts.spring import LinearSpring as LinearSpring
    from vibrokit.parts.spring import Spring as Spring
    from vibrokit.report.report import Report as Report
    from vibrokit.reproduction.reproduce import reproduce as reproduce
    from vibrokit.results.codes import Code as Code
    from vibrokit.results.codes import Severity as Severity
    from vibrokit.results.energy import ActivationEnergy as ActivationEnergy
    from vibrokit.results.energy import Bound as Bound
    from vibrokit.results.energy_continuation import EnergyContinuation as EnergyContinuation
    from vibrokit.results.exit_rate import ExitRate as ExitRate
    from vibrokit.results.files import load_result as load_result
    from vibrokit.results.finding import Finding as Finding
    from vibrokit.results.record import Record as Record
    from vibrokit.results.result import Result as Result
    from vibrokit.results.structure import Structure as Structure
    from vibrokit.results.sweep import Sweep as Sweep
    from vibrokit.scene_file import bundled_scenes as bundled_scenes
    from vibrokit.scene_file import load_scene as load_scene
    from vibrokit.scene_file import save_scene as save_scene
    from vibrokit.structure.continuation import continuation as continuation
    from vibrokit.structure.find import find_structure as find_structure
    from vibrokit.structure.shocks import shape_stability as shape_stability
    from vibrokit.structure.unstable_orbits import unstable_orbits as unstable_orbits

__version__ = "0.1.0"

# The imports above are for type checkers; at run time their text says where each name is.
_IMPORT = re.compile(r"^    from (\S+) import \w+ as (\w+)$", re.MULTILINE)
_MODULES = {name: module for module, name in _IMPORT.findall(Path(__file__).read_text("utf-8"))}

__all__ = list(_MODULES)


def __getattr__(name: str) -> Any:
    if name in ("errors", "testing"):
        return import_module(f"vibrokit.{name}")
    if name not in _MODULES:
        raise AttributeError(f"module 'vibrokit' has no attribute {name!r}; it offers {', '.join(_MODULES)}.")
    value = getattr(import_module(_MODULES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_MODULES, "errors", "testing"})
