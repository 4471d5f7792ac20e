"""Hunt and Crossley's contact law, a plug-in for vibrokit."""

from vibrokit_hunt_crossley.law import HuntCrossley as HuntCrossley

__all__ = ["HuntCrossley"]
