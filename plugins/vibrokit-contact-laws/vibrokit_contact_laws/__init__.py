"""Published dissipative contact laws, a plug-in for vibrokit."""

from vibrokit_contact_laws.hysteresis import HysteresisLaw as HysteresisLaw
from vibrokit_contact_laws.kuwabara_kono import KuwabaraKono as KuwabaraKono
from vibrokit_contact_laws.published import Flores as Flores
from vibrokit_contact_laws.published import Gonthier as Gonthier
from vibrokit_contact_laws.published import HerbertMcWhannell as HerbertMcWhannell
from vibrokit_contact_laws.published import HuGuo as HuGuo
from vibrokit_contact_laws.published import LankaraniNikravesh as LankaraniNikravesh
from vibrokit_contact_laws.published import LeeWang as LeeWang
from vibrokit_contact_laws.published import ZhiyingQishao as ZhiyingQishao

__all__ = [
    "Flores",
    "Gonthier",
    "HerbertMcWhannell",
    "HuGuo",
    "HysteresisLaw",
    "KuwabaraKono",
    "LankaraniNikravesh",
    "LeeWang",
    "ZhiyingQishao",
]
