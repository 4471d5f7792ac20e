"""Public names and where they are defined, for type checkers and for `__init__.py`."""

from typing import Any

from vibrokit.analyzers.action_graph import ActionGraph as ActionGraph
from vibrokit.analyzers.action_plot import ActionPlot as ActionPlot
from vibrokit.analyzers.analyzer import Analysis as Analysis
from vibrokit.analyzers.analyzer import Analyzer as Analyzer
from vibrokit.analyzers.exits import (
    Exit as Exit,
)
from vibrokit.analyzers.exits import (
    FirstContact as FirstContact,
)
from vibrokit.analyzers.exits import (
    LeaveBasin as LeaveBasin,
)
from vibrokit.analyzers.exits import (
    LeaveRegion as LeaveRegion,
)
from vibrokit.analyzers.graph.search import GraphSearch as GraphSearch
from vibrokit.analyzers.least_action import LeastAction as LeastAction
from vibrokit.analyzers.problem import ExitProblem as ExitProblem
from vibrokit.analyzers.shooting.shooting import Shooting as Shooting
from vibrokit.comparison.transitions import Transitions as Transitions
from vibrokit.kernels.free_flight import FreeFlight as FreeFlight
from vibrokit.kernels.order8 import Order8 as Order8
from vibrokit.kernels.rk4 import RK4 as RK4
from vibrokit.oscillator import Oscillator as Oscillator
from vibrokit.parts.barrier import Barrier as Barrier
from vibrokit.parts.contact.contact_law import ContactLaw as ContactLaw
from vibrokit.parts.contact.custom import CustomLaw as CustomLaw
from vibrokit.parts.contact.hertz import Hertz as Hertz
from vibrokit.parts.contact.linear import Linear as Linear
from vibrokit.parts.excitation.constant import Constant as Constant
from vibrokit.parts.excitation.excitation import Excitation as Excitation
from vibrokit.parts.excitation.harmonic import Harmonic as Harmonic
from vibrokit.parts.noise.noise_model import NoiseModel as NoiseModel
from vibrokit.parts.noise.state_dependent import StateDependentNoise as StateDependentNoise
from vibrokit.parts.noise.white import WhiteNoise as WhiteNoise
from vibrokit.parts.parameter import parameter as parameter
from vibrokit.parts.spring.cubic import CubicSpring as CubicSpring
from vibrokit.parts.spring.custom import CustomSpring as CustomSpring
from vibrokit.parts.spring.linear import LinearSpring as LinearSpring
from vibrokit.parts.spring.spring import Spring as Spring
from vibrokit.results.energy import ActivationEnergy as ActivationEnergy
from vibrokit.results.energy import Bound as Bound
from vibrokit.results.files import load_result as load_result
from vibrokit.results.finding import Code as Code
from vibrokit.results.finding import Finding as Finding
from vibrokit.results.finding import Severity as Severity
from vibrokit.results.record import Record as Record
from vibrokit.results.result import Result as Result
from vibrokit.results.structure import Structure as Structure
from vibrokit.scene_file import bundled_scenes as bundled_scenes
from vibrokit.scene_file import load_scene as load_scene
from vibrokit.scene_file import save_scene as save_scene
from vibrokit.structure.continuation import continuation as continuation
from vibrokit.structure.find import find_structure as find_structure
from vibrokit.structure.shocks import shape_stability as shape_stability
from vibrokit.structure.unstable_orbits import unstable_orbits as unstable_orbits

__version__: str

def __getattr__(name: str) -> Any: ...
