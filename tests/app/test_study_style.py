from vsep_app.figures.study_style import colour, marker

from vsep.studies.catalogue import CATALOGUE


def test_no_two_methods_of_a_panel_look_the_same():
    for plan in CATALOGUE["fig-5-methods"].curves:
        looks = [(colour(method), marker(method)) for method in plan.methods]
        assert len(set(looks)) == len(looks) > 4
