import runpy
from pathlib import Path
from types import SimpleNamespace

import matplotlib.pyplot as plt
import pytest

REPOSITORY = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Run a tutorial by name, and return its names and the figures that it shows; it must leave no file behind."""
    figures = []

    def show():
        figures.extend(map(plt.figure, plt.get_fignums()))
        plt.close("all")

    def script(name):
        figures.clear()
        made = runpy.run_path(str(REPOSITORY / "tutorials" / f"{name}.py"), run_name="__main__")
        assert not plt.get_fignums()  # pictures come before the end
        return SimpleNamespace(**made, figures=tuple(figures))

    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("elsewhere")
        patch.chdir(folder)
        plt.switch_backend("agg")
        patch.setattr(plt, "show", show)
        yield script
    assert not list(folder.iterdir())
