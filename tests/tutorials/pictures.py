"""What is expected of the pictures of a tutorial."""


def assert_pictures(tutorial, count):
    """Check the number of pictures, and that the axes of each have names."""
    assert len(tutorial.figures) == count
    for figure in tutorial.figures:
        panels = figure.get_axes()
        assert panels[0].get_ylabel()
        assert any(panel.get_xlabel() for panel in panels)
