"""What ``--json`` prints: one object, with the versions that made it."""

import json
from typing import Any

from vibrokit.results.record import versions


def print_json(**data: Any) -> None:
    """Print one object; `data` has been made plain, so that no number in it is infinite or NaN."""
    print(json.dumps({**data, "versions": versions()}, allow_nan=False))
