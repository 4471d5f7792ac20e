"""The parts of which a scene has at most one each, by the field that holds them."""

from __future__ import annotations

from vibrokit.parts.friction import Friction
from vibrokit.parts.noise import NoiseModel
from vibrokit.parts.part import Part
from vibrokit.parts.spring import Spring

FORCES_OF_STATE: dict[str, type[Part]] = {"spring": Spring, "friction": Friction}
"""Parts with a force(x, v) on the mass."""

SINGLE_PARTS: dict[str, type[Part]] = FORCES_OF_STATE | {"noise": NoiseModel}
