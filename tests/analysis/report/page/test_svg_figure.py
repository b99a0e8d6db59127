import re

import numpy as np

from analysis.report.page.svg_figure import PageFigure, new_figure, page_figure


def drawn(shift: float) -> PageFigure:
    with new_figure([1.0, 1.0]) as (figure, panels):
        for axes in panels:
            axes.plot([0, 1, 2], [0, 1, 0])
            place = np.array(axes.get_position().bounds)
            axes.set_position(tuple(place * (1 + shift)))
        return page_figure(figure, "circle", "A turning circle", "The track")


def test_coordinates_that_differ_by_rounding_give_the_same_page() -> None:
    assert drawn(shift=0.0).svg == drawn(shift=1e-12).svg


def test_each_reference_within_a_figure_has_its_target_once() -> None:
    svg = drawn(shift=0.0).svg
    targets = re.findall(r'\bid="([^"]*)"', svg)
    references = re.findall(r'(?:url\(#|xlink:href="#)([^)"]*)', svg)
    assert references
    assert set(references) <= set(targets)
    assert len(targets) == len(set(targets))
