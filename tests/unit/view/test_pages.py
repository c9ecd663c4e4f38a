"""Both pages begin alike: STOP, the state and the operator's buttons are where the eye found them on the
other page.
"""

from importlib.resources import files


def head(name):
    text = (files("rtctl.client") / "view_static" / name).read_text()
    return text[text.index("<header>") : text.index("</header>")]


def test_the_pages_have_one_header_but_for_the_page_they_are():
    scope, world = head("index.html"), head("world.html")
    assert scope != world
    assert scope.replace(' aria-current="page"', "") == world.replace(' aria-current="page"', "")
    assert scope.index('id="stop"') < scope.index('id="state"')
